"""Log readers: a new format needs one module, and the checks of a log are the same for all formats."""

from importlib import import_module
from pkgutil import iter_modules

import pytest
from made_up_batch import table

from ccmodel.rig import readers
from ccmodel.rig.findings import LogError
from ccmodel.rig.ingest import ingest_batch


def test_every_module_of_the_folder_with_a_format_is_registered():
    modules = {m.name for m in iter_modules(readers.__path__)}
    assert readers.registry().keys() == {
        m for m in modules if hasattr(import_module(f"{readers.__name__}.{m}"), "FORMAT")
    }
    assert {"text", "parquet"} <= readers.registry().keys()


def test_a_format_gives_the_same_recording(bench):
    plain = ingest_batch(bench.write().folder).recordings
    for entry in bench.described["recordings"]:
        entry["file"] = f"{entry['id']}.parquet"
        bench.tables[entry["id"]].to_parquet(bench.folder / entry["file"])
    ingested = ingest_batch(bench.write().folder)
    assert ingested.findings == []
    for one, other in zip(plain, ingested.recordings, strict=True):
        assert one.channels.keys() == other.channels.keys()
        assert all((one[c] == other[c]).all() for c in one.channels)


def test_the_checks_name_the_rows_of_the_format(bench):
    bench.described["recordings"][0]["file"] = "one.parquet"
    table(seed=1).drop(index=range(100, 150)).to_parquet(bench.folder / "one.parquet")
    (finding,) = ingest_batch(bench.write().folder).findings
    assert (finding.row, finding.column) == (101, "time_s")
    assert "a gap of 0.204 s" in finding.text


@pytest.mark.parametrize("name", ["ONE.CSV", "one.txt", "one"])
def test_a_log_of_an_unknown_suffix_is_read_as_csv(bench, name):
    bench.write().log().rename(bench.folder / name)
    raw = readers.read(bench.folder / name)
    assert list(raw.columns) == list(bench.tables["one"].columns)
    assert raw.index[0] == 2


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(LogError, match="there is no such file"):
        readers.read(tmp_path / "nowhere.csv")
