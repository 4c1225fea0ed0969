"""Recordings and simulations -> the table of all errors."""

from collections.abc import Iterable
from pathlib import Path

import pandas as pd

from ccmodel import provenance
from ccmodel.errors import error_table
from ccmodel.outputs import new_file
from ccmodel.progress import Progress, each_of, silent
from ccmodel.steps.files import read_pairs, write_table


def tabulate_errors(
    runs: Iterable[tuple[str, Path, Path]], csv_file: Path, parquet_file: Path, progress: Progress = silent
) -> None:
    """Write the errors of all runs as CSV and Parquet; a run is a parameter set, recordings and simulations."""
    runs = list(runs)
    each = each_of(runs, progress, lambda run: f"errors of {run[1].stem}, parameters {run[0]}")
    table = pd.concat([error_table(read_pairs(r, s), name) for name, r, s in each], ignore_index=True)
    # Pandas writes these attributes to the Parquet file.
    table.attrs = provenance.of_inputs(file for _, *files in runs for file in files)
    write_table(csv_file, table)
    with new_file(parquet_file) as fresh:
        table.to_parquet(fresh, index=False)
