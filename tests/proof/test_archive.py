"""Results are archived beside the page, and restored elsewhere."""

import json

from typer.testing import CliRunner

from proof import conceal
from proof.archive import pack, unpack
from proof.cli import app

MINE = {"sources": "a", "builder": "b"}


def write(cases, number, **result):
    target = cases / number / "result.json"
    target.parent.mkdir(parents=True)
    target.write_text(json.dumps(MINE | result))


def results(cases):
    return {f.parent.name: json.loads(f.read_text()) for f in cases.glob("*/result.json")}


def test_archived_results_are_restored(tmp_path):
    write(tmp_path / "here", "0007", seed=7, errors={"tau_in_Nm": {"floor": 0.1 + 0.2}})
    write(tmp_path / "here", "0012", seed=12, diagnosis=None)
    assert pack(tmp_path / "here", tmp_path / "packed.jsonl.gz") == 2
    assert unpack(tmp_path / "packed.jsonl.gz", tmp_path / "there", MINE) == 2
    assert results(tmp_path / "there") == results(tmp_path / "here")
    pack(tmp_path / "there", tmp_path / "again.jsonl.gz")
    assert (tmp_path / "again.jsonl.gz").read_bytes() == (tmp_path / "packed.jsonl.gz").read_bytes()


def test_results_of_other_sources_and_existing_results_are_not_restored(tmp_path):
    write(tmp_path / "here", "0001", seed=1)
    write(tmp_path / "here", "0002", seed=2, sources="other")
    write(tmp_path / "here", "0003", seed=3, builder="other")
    write(tmp_path / "there", "0001", seed=100)
    pack(tmp_path / "here", tmp_path / "packed.jsonl.gz")
    assert unpack(tmp_path / "packed.jsonl.gz", tmp_path / "there", MINE) == 0
    assert results(tmp_path / "there") == {"0001": MINE | {"seed": 100}}


def test_a_run_resumes_from_the_archive(tmp_path):
    here = {"sources": conceal.digest_of(), "builder": conceal.builder_digest()}
    write(tmp_path / "here", "0001", **here)
    pack(tmp_path / "here", tmp_path / "packed.jsonl.gz")
    for archive, restored in (("no-such-file", set()), ("packed.jsonl.gz", {"0001"})):
        arguments = ["resume", "--archive", str(tmp_path / archive), "--out", str(tmp_path / "there")]
        assert CliRunner().invoke(app, arguments).exit_code == 0
        assert set(results(tmp_path / "there")) == restored
