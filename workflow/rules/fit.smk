rule fit:
    input:
        recordings=lambda wildcards: [recordings_of(b) for b in fitted_to(wildcards)],
        summaries=lambda wildcards: [summary_of(b) for b in fitted_to(wildcards)],
    output:
        f"{RESULTS}/fits/{{parameters}}/{{scope}}.json",
    log:
        f"{RESULTS}/logs/fit/{{parameters}}/{{scope}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/fit/{{parameters}}/{{scope}}.tsv"
    conda:
        "../envs/ccmodel.yaml"
    threads: 2
    resources:
        mem_mb=1000,
        runtime=30,
    params:
        problem=lambda wildcards: CONFIG.fits[wildcards.parameters].model_dump_json(),
        sources=source_digest("ccmodel.steps.fit"),
    message:
        "Fitting parameters '{wildcards.parameters}' ({wildcards.scope})"
    script:
        "../scripts/fit_parameters.py"
