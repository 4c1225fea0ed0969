rule tabulate_errors:
    input:
        recordings=[recordings_of(batch) for _, batch in runs()],
        simulated=[simulated_of(parameters, batch) for parameters, batch in runs()],
    output:
        csv=in_report(f"{RESULTS}/tables/errors.csv", "errors", "Tables"),
        parquet=f"{RESULTS}/tables/errors.parquet",
    log:
        f"{RESULTS}/logs/tabulate_errors.log",
    benchmark:
        f"{RESULTS}/benchmarks/tabulate_errors.tsv"
    group:
        "page"
    conda:
        "../envs/ccmodel.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        parameters=[parameters for parameters, _ in runs()],
        sources=source_digest("ccmodel.report.tables"),
    message:
        "Comparing the model with all recordings"
    script:
        "../scripts/tabulate_errors.py"


FINDINGS = [str(file) for file in [RAW / "findings.json"] if file.exists()]


rule write_report:
    input:
        errors=f"{RESULTS}/tables/errors.parquet",
        fits=sorted({fit_of(p, batch) for p, batch in runs() if p in CONFIG.fits}),
        summaries=[summary_of(batch) for batch in BATCHES],
        # What an import of all batches has left out.
        findings=FINDINGS,
        simulations=[
            simulated_of(p, batch).removesuffix(".nc") + ".json" for p, batch in runs()
        ],
        recordings=[recordings_of(batch) for _, batch in runs()],
        simulated=[simulated_of(parameters, batch) for parameters, batch in runs()],
        diagnoses=[verdict_of(name) for name in DIAGNOSES],
        reports=[f"{RESULTS}/diagnoses/{name}/report.html" for name in DIAGNOSES],
        # Read here alone, after all verdicts.
        concealed=CONFIG.concealed or [],
        figures=[figure for name in STUDIES for figure in figures(name, "png")],
        tables=[table for name in STUDIES for table in tables(name)],
    output:
        page=in_report(f"{RESULTS}/index.html", "page", "Page"),
        left_out=f"{RESULTS}/left-out.json",
    log:
        f"{RESULTS}/logs/write_report.log",
    benchmark:
        f"{RESULTS}/benchmarks/write_report.tsv"
    group:
        "page"
    conda:
        "../envs/ccmodel.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        raw=CONFIG.raw,
        parameters=[parameters for parameters, _ in runs()],
        unusable=UNUSABLE,
        content=content_of([*FINDINGS, *filter(None, [CONFIG.concealed])]),
        studies=[
            {
                "kind": study.kind,
                "name": name,
                "heading": study.heading,
                "settings": study.model_dump(mode="json"),
                "parameters": " and ".join(
                    sorted({p for _, p, _ in study.needs(CONFIG, LOOPS, BATCHES)})
                ),
            }
            | ({"summary": tables(name)[-1]} if study.tables else {})
            for name, study in STUDIES.items()
        ],
        sources=[source_digest("ccmodel.report.page")]
        + [
            source_digest(f"ccmodel.studies.{kind}.settings")
            for kind in sorted({study.kind for study in STUDIES.values()})
        ],
    message:
        "Writing the page"
    script:
        "../scripts/write_report.py"
