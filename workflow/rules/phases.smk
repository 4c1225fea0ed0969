rule draw_phases:
    output:
        report(
            expand(f"{RESULTS}/figures/phases/{{name}}.png", name=PHASE_FIGURES),
            caption="../report/phases.rst",
            category="Simulated",
        ),
        expand(f"{RESULTS}/figures/phases/{{name}}.svg", name=PHASE_FIGURES),
    log:
        f"{RESULTS}/logs/draw_phases.log",
    benchmark:
        f"{RESULTS}/benchmarks/draw_phases.tsv"
    conda:
        "../envs/ccmodel.yaml"
    params:
        example=CONFIG.phases and CONFIG.phases.model_dump_json(),
        sources=source_digest("ccmodel.stages.phases"),
    message:
        "Drawing phases I to IV"
    script:
        "../scripts/draw_phases.py"
