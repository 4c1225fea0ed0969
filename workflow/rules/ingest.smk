rule ingest:
    input:
        lambda wildcards: sorted(
            str(f) for f in (RAW / wildcards.batch).iterdir() if f.is_file()
        ),
    output:
        recordings=f"{RESULTS}/recordings/{{batch}}.nc",
        summary=f"{RESULTS}/recordings/{{batch}}.json",
    log:
        f"{RESULTS}/logs/ingest/{{batch}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/ingest/{{batch}}.tsv"
    conda:
        "../envs/ccmodel.yaml"
    params:
        folder=lambda wildcards: str(RAW / wildcards.batch),
        sources=source_digest("rig", "recording.py", "typed.py"),
    message:
        "Reading batch {wildcards.batch}"
    script:
        "../scripts/ingest_batch.py"
