rule ingest:
    input:
        lambda wildcards: [str(f) for f in files_in(RAW / wildcards.batch)],
    output:
        recordings=f"{RESULTS}/recordings/{{batch}}.nc",
        summary=f"{RESULTS}/recordings/{{batch}}.json",
    log:
        f"{RESULTS}/logs/ingest/{{batch}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/ingest/{{batch}}.tsv"
    group:
        "reading"
    conda:
        "../envs/ccmodel.yaml"
    threads: 1
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        folder=lambda wildcards: str(RAW / wildcards.batch),
        # As `content_of`, of all files of the folder.
        content=lambda wildcards: folder_digest(RAW / wildcards.batch),
        sources=source_digest("ccmodel.steps.ingest"),
    message:
        "Reading batch {wildcards.batch}"
    script:
        "../scripts/ingest_batch.py"
