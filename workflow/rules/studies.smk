# A rule for every study of the configuration. Its settings state its runs, tables and figures (ccmodel.studies).
for name, study in STUDIES.items():
    needs = study.needs(CONFIG, LOOPS, BATCHES)
    fits = [fit_of(parameters, batch) for _, parameters, batch in needs]

    rule:
        name:
            f"study_{name}"
        input:
            recordings=[recordings_of(batch) for _, _, batch in needs],
            summaries=sorted({summary_of(batch) for _, _, batch in needs}),
            simulated=[simulated_of(p, batch) for _, p, batch in needs],
            fits=sorted(set(fits) - {""}),
            # A model of a diagnosis stands beside its verdict, which some studies state.
            verdicts=sorted(
                {
                    verdict_of(batch)
                    for _, parameters, batch in needs
                    if parameters in MODEL_FILES
                }
            ),
            files=study.files,
        output:
            csv=[in_report(f, "table", "Tables", study=name) for f in csv_tables(name)],
            summary=tables(name)[-1:],
            png=[
                in_report(f, "study", "Studies", study=name)
                for f in figures(name, "png")
            ],
            svg=figures(name, "svg"),
            pdf=figures(name, "pdf"),
        log:
            f"{RESULTS}/logs/studies/{name}.log",
        benchmark:
            f"{RESULTS}/benchmarks/studies/{name}.tsv"
        group:
            "studies"
        conda:
            "../envs/ccmodel.yaml"
        threads: 1
        resources:
            mem_mb=1000,
            runtime=30,
        params:
            kind=study.kind,
            caption=study.caption(),
            settings=study.model_dump_json(),
            measuring=CONFIG.measuring.model_dump_json(),
            labels=[label for label, _, _ in needs],
            fits=fits,
            content=content_of(study.files),
            state=study.state,
            sources=source_digest(f"ccmodel.studies.{study.kind}.study"),
        message:
            f"Making study {name}"
        script:
            "../scripts/judge_study.py"
