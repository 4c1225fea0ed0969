"""A CSV log is read in blocks of lines: where they end changes neither the table nor what is said of a damaged log."""

import gzip

import pandas as pd
import pytest
from made_up_batch import table

from ccmodel.rig.findings import LogError
from ccmodel.rig.readers import csv

LOG = table(n=60, seed=1).to_csv(index=False)
LINES = LOG.splitlines(keepends=True)


def changed(row, old, new):
    return "".join([*LINES[:row], LINES[row].replace(old, new, 1), *LINES[row + 1 :]])


WHOLE = {
    "sound": LOG,
    "byte order mark, Windows line ends": "\ufeff" + LOG.replace("\n", "\r\n"),
    "empty lines at the end": LOG + "\n\n,,\n",
    "a text among numbers": changed(40, ",", ",x"),
    "whole numbers in some blocks only": changed(3, LINES[3].split(",")[3], "7"),
    "no line feed": LOG.replace("\n", "\r"),
}
REFUSED = {
    "cell missing": changed(50, ",", ""),
    "an empty line between": "".join([*LINES[:30], "\n", *LINES[30:]]),
    "cut": LOG[:-4],
    "commas left of a line": LOG + ",,",
    "nothing": "",
    "empty lines only": "\n,\n\n",
    "a header alone": LINES[0],
    "another separator": LOG.replace(",", ";"),
}


@pytest.fixture
def read(tmp_path, monkeypatch):
    def in_blocks_of(size, text, gzipped=False):
        monkeypatch.setattr(csv, "BLOCK_BYTES", size)
        file = tmp_path / ("log.csv.gz" if gzipped else "log.csv")
        content = text.encode()
        file.write_bytes(gzip.compress(content) if gzipped else content)
        return csv.read(file)

    return in_blocks_of


@pytest.mark.parametrize("gzipped", [False, True])
@pytest.mark.parametrize("size", [7, 100, 1000])
@pytest.mark.parametrize("name", WHOLE)
def test_the_table_is_the_same(read, name, size, gzipped):
    whole, in_blocks = read(10**7, WHOLE[name]), read(size, WHOLE[name], gzipped)
    assert (in_blocks.columns == whole.columns).all() and (in_blocks.index == whole.index).all()
    for k in range(whole.shape[1]):
        one, other = whole.iloc[:, k], in_blocks.iloc[:, k]
        assert numbers(one).equals(numbers(other)) and one.isna().equals(other.isna())


def numbers(cells):
    return pd.to_numeric(cells.astype("string"), errors="coerce").astype("Float64")


@pytest.mark.parametrize("size", [7, 100, 1000])
@pytest.mark.parametrize("name", REFUSED)
def test_the_refusal_is_the_same(read, name, size):
    said = []
    for block in (10**7, size):
        with pytest.raises(LogError) as error:
            read(block, REFUSED[name])
        said.append(error.value.args)
    assert said[0] == said[1]


def test_bytes_that_are_no_text_are_named_by_their_row(read, tmp_path, monkeypatch):
    monkeypatch.setattr(csv, "BLOCK_BYTES", 100)
    damaged = LOG.encode().splitlines(keepends=True)
    damaged[44] = b"\xff" + damaged[44]
    (tmp_path / "log.csv").write_bytes(b"".join(damaged))
    with pytest.raises(LogError) as error:
        csv.read(tmp_path / "log.csv")
    assert error.value.args[0] == 45
