# A batch, or all batches of a rig together; the wildcard is the name of either.
rule diagnose:
    input:
        lambda wildcards: [
            recordings_of(batch)
            for batch in CONFIG.diagnosed_rigs.get(wildcards.batch, [wildcards.batch])
        ],
    output:
        f"{RESULTS}/diagnoses/{{batch}}/diagnosis.json",
        in_report(
            f"{RESULTS}/diagnoses/{{batch}}/report.html",
            "diagnosis",
            "Diagnoses",
            batch="{batch}",
        ),
        f"{RESULTS}/diagnoses/{{batch}}/calibrated.json",
        f"{RESULTS}/diagnoses/{{batch}}/model.json",
        f"{RESULTS}/diagnoses/{{batch}}/nearest.json",
    log:
        f"{RESULTS}/logs/diagnose/{{batch}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/diagnose/{{batch}}.tsv"
    conda:
        "../envs/ccmodel.yaml"
    threads: 2
    resources:
        mem_mb=2000,
        runtime=150,
    params:
        settings=lambda wildcards: CONFIG.diagnosing_of(
            wildcards.batch
        ).model_dump_json(),
        sources=source_digest("ccmodel.studies.diagnosis.run"),
        what=lambda wildcards: (
            "rig" if wildcards.batch in CONFIG.diagnosed_rigs else "batch"
        ),
    message:
        "Diagnosing {params.what} {wildcards.batch}"
    script:
        "../scripts/diagnose_batch.py"
