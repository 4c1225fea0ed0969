rule write_report:
    input:
        errors=f"{RESULTS}/tables/errors.parquet",
        fits=fits(),
        summaries=[f"{RESULTS}/recordings/{batch}.json" for batch in BATCHES],
        simulations=[
            simulated.removesuffix(".nc") + ".json" for _, _, simulated in runs()
        ],
        figures=[f"{RESULTS}/figures/{study}.png" for study in STUDIES],
        diagnoses=[
            f"{RESULTS}/diagnoses/{batch}/diagnosis.json" for batch in diagnosed()
        ],
        phases=rules.draw_phases.output if CONFIG.phases else [],
        claims=[f"{RESULTS}/tables/claims.json"] if CONFIG.claims else [],
        accuracy=[f"{RESULTS}/tables/accuracy.json"] if CONFIG.accuracy else [],
    output:
        page=f"{RESULTS}/index.html",
        left_out=f"{RESULTS}/left-out.json",
    log:
        f"{RESULTS}/logs/write_report.log",
    benchmark:
        f"{RESULTS}/benchmarks/write_report.tsv"
    conda:
        "../envs/ccmodel.yaml"
    params:
        config=CONFIG.model_dump_json(),
        unusable=UNUSABLE,
        studies={name: study.model_dump_json() for name, study in STUDIES.items()},
        sources=source_digest("ccmodel.stages.report"),
    message:
        "Writing the page"
    script:
        "../scripts/write_report.py"
