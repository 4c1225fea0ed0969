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
