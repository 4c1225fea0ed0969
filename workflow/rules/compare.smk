rule tabulate_errors:
    input:
        recordings=[recordings for _, recordings, _ in runs()],
        simulated=[simulated for _, _, simulated in runs()],
    output:
        csv=f"{RESULTS}/tables/errors.csv",
        parquet=f"{RESULTS}/tables/errors.parquet",
    log:
        f"{RESULTS}/logs/tabulate_errors.log",
    benchmark:
        f"{RESULTS}/benchmarks/tabulate_errors.tsv"
    conda:
        "../envs/ccmodel.yaml"
    params:
        parameters=[parameters for parameters, _, _ in runs()],
        sources=source_digest("ccmodel.stages.tabulate"),
    message:
        "Comparing the model with all recordings"
    script:
        "../scripts/tabulate_errors.py"


rule draw_study:
    input:
        recordings=lambda wildcards: [
            recordings_of(batch) for batch in STUDIES[wildcards.study].batches
        ],
        simulated=lambda wildcards: [
            simulated_of(CONFIG.parameters_of(STUDIES[wildcards.study]), batch)
            for batch in STUDIES[wildcards.study].batches
        ],
    output:
        png=report(
            f"{RESULTS}/figures/{{study}}.png",
            caption="../report/study.rst",
            category="Studies",
            labels={"study": "{study}"},
        ),
        svg=f"{RESULTS}/figures/{{study}}.svg",
    log:
        f"{RESULTS}/logs/draw_study/{{study}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/draw_study/{{study}}.tsv"
    conda:
        "../envs/ccmodel.yaml"
    params:
        study=lambda wildcards: STUDIES[wildcards.study].model_dump_json(),
        sources=source_digest("ccmodel.stages.draw"),
    message:
        "Drawing study {wildcards.study}"
    script:
        "../scripts/draw_study.py"


rule judge_claims:
    input:
        recordings=lambda wildcards: [recordings_of(b) for _, _, b in claim_runs()],
        simulated=lambda wildcards: [simulated_of(p, b) for _, p, b in claim_runs()],
        fit=lambda wildcards: fit_if_any(*claim_runs()[0][1:]),
    output:
        csv=f"{RESULTS}/tables/claims.csv",
        json=f"{RESULTS}/tables/claims.json",
        png=f"{RESULTS}/figures/claims.png",
        svg=f"{RESULTS}/figures/claims.svg",
        model_png=f"{RESULTS}/figures/claims-model.png",
        model_svg=f"{RESULTS}/figures/claims-model.svg",
    log:
        f"{RESULTS}/logs/judge_claims.log",
    benchmark:
        f"{RESULTS}/benchmarks/judge_claims.tsv"
    conda:
        "../envs/ccmodel.yaml"
    params:
        claims=lambda wildcards: CONFIG.claims.model_dump_json(),
        measuring=CONFIG.measuring.model_dump_json(),
        variables=lambda wildcards: [variable for variable, _, _ in claim_runs()],
        sources=source_digest("ccmodel.stages.claims"),
    message:
        "Putting the paper's words in numbers"
    script:
        "../scripts/judge_claims.py"


rule judge_accuracy:
    input:
        recordings=[recordings_of(batch) for batch in BATCHES],
        simulated=lambda wildcards: [
            simulated_of(CONFIG.parameters_of(CONFIG.accuracy), batch)
            for batch in BATCHES
        ],
        fits=lambda wildcards: sorted(
            {
                fit
                for b in BATCHES
                for fit in fit_if_any(CONFIG.parameters_of(CONFIG.accuracy), b)
            }
        ),
    output:
        csv=f"{RESULTS}/tables/accuracy.csv",
        by_recording=f"{RESULTS}/tables/accuracy-by-recording.csv",
        json=f"{RESULTS}/tables/accuracy.json",
        png=f"{RESULTS}/figures/accuracy.png",
        svg=f"{RESULTS}/figures/accuracy.svg",
        ratio_png=f"{RESULTS}/figures/accuracy-ratio.png",
        ratio_svg=f"{RESULTS}/figures/accuracy-ratio.svg",
    log:
        f"{RESULTS}/logs/judge_accuracy.log",
    benchmark:
        f"{RESULTS}/benchmarks/judge_accuracy.tsv"
    conda:
        "../envs/ccmodel.yaml"
    params:
        accuracy=lambda wildcards: CONFIG.accuracy.model_dump_json(),
        measuring=CONFIG.measuring.model_dump_json(),
        fit_of_batch=lambda wildcards: [
            fit
            for b in BATCHES
            for fit in fit_if_any(CONFIG.parameters_of(CONFIG.accuracy), b) or [""]
        ],
        sources=source_digest("ccmodel.stages.accuracy"),
    message:
        "Judging bias and scatter of the model"
    script:
        "../scripts/judge_accuracy.py"
