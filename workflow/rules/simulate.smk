rule simulate:
    input:
        recordings=lambda wildcards: recordings_of(wildcards.batch),
        read=lambda wildcards: summary_of(wildcards.batch),
        fit=lambda wildcards: fit_of(wildcards.parameters, wildcards.batch) or [],
    output:
        simulated=f"{RESULTS}/simulated/{{parameters}}/{{batch}}.nc",
        summary=f"{RESULTS}/simulated/{{parameters}}/{{batch}}.json",
    log:
        f"{RESULTS}/logs/simulate/{{parameters}}/{{batch}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/simulate/{{parameters}}/{{batch}}.tsv"
    group:
        "simulating"
    conda:
        "../envs/ccmodel.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=30,
    params:
        sources=source_digest("ccmodel.steps.simulate"),
    message:
        "Running the model on batch {wildcards.batch} with parameters '{wildcards.parameters}'"
    script:
        "../scripts/simulate_batch.py"
