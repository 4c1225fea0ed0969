# The workflow in Snakemake's standard layout, found by `snakemake` at the top.
include: "workflow/Snakefile"


# Rules of an included file are never the default target.
workflow.default_target = "all"
