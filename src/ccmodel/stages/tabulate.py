"""All recordings and simulations -> the error table."""

from collections.abc import Iterable
from pathlib import Path

import pandas as pd

from ccmodel import provenance
from ccmodel.compare.errors import error_table
from ccmodel.stages.files import read_pairs


def tabulate_errors(runs: Iterable[tuple[str, Path, Path]], csv_file: Path, parquet_file: Path) -> None:
    """One error table for all runs (name of the parameter set, recordings, simulated), as CSV and Parquet."""
    runs = list(runs)
    table = pd.concat([error_table(read_pairs(r, s), name) for name, r, s in runs], ignore_index=True)
    # Pandas keeps these in the Parquet file.
    table.attrs = provenance.of_inputs(file for _, *files in runs for file in files)
    table.to_csv(csv_file, index=False, float_format="%.6g")
    table.to_parquet(parquet_file, index=False)
