rule diagnose:
    input:
        recordings=lambda wildcards: [
            recordings_of(b) for b in diagnosed_together(wildcards)
        ],
        summaries=lambda wildcards: [
            summary_of(b) for b in diagnosed_together(wildcards)
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
