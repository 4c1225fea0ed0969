"""Damage that no finding names moves no fitted value by more than its interval."""

import gzip
import shutil

import numpy as np
import pytest

import ccmodel
from ccmodel.rig.ingest import ingest_batch
from fuzzing import examples
from proof.build import record
from proof.cases import draw

SEED, DIGITS = 4, "0123456789"
MOST_FLIPS = 20


def flipped(log: str, random: np.random.Generator) -> str:
    """A log with other digits in some analog readings, as a faulty transfer leaves them.

    Times and counts are left: a wrong one is a jump, which is refused.
    """
    header, *rows = log.splitlines()
    analog = [k for k, name in enumerate(header.split(",")) if name.endswith(("_A", "_V"))]
    for _ in range(random.integers(1, MOST_FLIPS + 1)):
        row, column = random.integers(len(rows)), random.choice(analog)
        cells = rows[row].split(",")
        at = random.choice([k for k, character in enumerate(cells[column]) if character in DIGITS])
        cells[column] = cells[column][:at] + DIGITS[random.integers(10)] + cells[column][at + 1 :]
        rows[row] = ",".join(cells)
    return "\n".join([header, *rows, ""])


@pytest.mark.long
def test_digits_that_no_finding_names_move_no_value_by_more_than_its_interval(tmp_path):
    case, silent, draws = draw(SEED, "clean"), 0, examples(8)
    source = tmp_path / case.name
    record(case, case.recordings, source)
    undamaged = ccmodel.fit(source)
    for seed in range(draws):
        random, folder = np.random.default_rng(seed), tmp_path / str(seed) / case.name
        shutil.copytree(source, folder)
        file = random.choice(sorted(folder.glob("*.csv*")))
        log = flipped(gzip.decompress(file.read_bytes()).decode(), random)
        file.write_bytes(gzip.compress(log.encode()))
        if any(finding.severity != "warning" for finding in ingest_batch(folder).findings):
            continue
        silent += 1
        after = ccmodel.fit(folder, trust_inputs=True).values
        for name, interval in undamaged.intervals.items():
            assert interval.low <= after[name] <= interval.high, f"seed {seed}: {name} became {after[name]:g}"
    assert silent > draws / 2
