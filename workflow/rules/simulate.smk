rule simulate:
    input:
        recordings=lambda wildcards: recordings_of(wildcards.batch),
        fit=lambda wildcards: fit_if_any(wildcards.parameters, wildcards.batch),
    output:
        simulated=f"{RESULTS}/simulated/{{parameters}}/{{batch}}.nc",
        summary=f"{RESULTS}/simulated/{{parameters}}/{{batch}}.json",
    log:
        f"{RESULTS}/logs/simulate/{{parameters}}/{{batch}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/simulate/{{parameters}}/{{batch}}.tsv"
    conda:
        "../envs/ccmodel.yaml"
    params:
        sources=source_digest("ccmodel.stages.simulate"),
    message:
        "Running the model on batch {wildcards.batch} with parameters '{wildcards.parameters}'"
    script:
        "../scripts/simulate_batch.py"
