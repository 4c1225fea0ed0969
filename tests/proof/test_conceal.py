"""A diagnosis that looks for the answer is caught; one that does not is let be."""

import json
import os

import pytest

from proof import conceal

PROOF = conceal.GUARD.parent
ROOT = PROOF.parent

HONEST = """
import os, pathlib, sys
batch, out = pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[4])
out.mkdir()
(out / "diagnosis.json").write_text((batch / "batch.yaml").read_text())
(out / "made").write_text(repr({f.stat().st_mtime > out.stat().st_mtime - 60 for f in batch.iterdir()}))
(out / "environment").write_text(repr(dict(os.environ)) + repr(sys.path))
"""

CHEATS = {
    "imports the rig": (f"import sys; sys.path.append({str(ROOT / 'src')!r}); import virtualrig", "virtualrig"),
    "imports the proof": (f"import sys; sys.path.append({str(ROOT)!r}); from proof.cases import draw", "proof"),
    "reads the plan": (f"open({str(PROOF / 'proof.yaml')!r}).read()", "proof.yaml"),
    "reads by descriptor": (f"import os; os.open({str(PROOF / 'proof.yaml')!r}, os.O_RDONLY)", "proof.yaml"),
    "climbs to other folders": ("import os; os.listdir('..')", "looked into .."),
    "asks another program": ("import subprocess; subprocess.run(['ls'])", "started a process"),
    "leaves a note": ("open('/var/tmp/note', 'w')", "wrote to /var/tmp/note"),
    "carries a note out": ("import os; open('a', 'w').close(); os.rename('a', '/var/tmp/a')", "os.rename of /var"),
    "calls someone": ("import socket; socket.create_connection(('127.0.0.1', 9))", "looked outside"),
    "swallows the refusal": (f"try: open({str(PROOF / 'proof.yaml')!r})\nexcept OSError: pass", "proof.yaml"),
    "alters the case": ("import sys; open(sys.argv[2] + '/batch.yaml', 'a').write('#')", "altered the batch"),
}


@pytest.fixture
def batch(tmp_path):
    folder = tmp_path / "case-1"
    folder.mkdir()
    (folder / "batch.yaml").write_text("format: 1\n")
    os.utime(folder / "batch.yaml", (0, 0))
    return folder


@pytest.fixture
def diagnosis(tmp_path):
    """Call with a body: a package whose command is that."""

    def made(body):
        package = tmp_path / "made" / "ccmodel"
        package.mkdir(parents=True)
        (package / "__init__.py").touch()
        lines = "".join(f"    {line}\n" for line in body.splitlines())
        (package / "cli.py").write_text(f"def main():\n{lines}")
        return package

    return made


@pytest.fixture(autouse=True)
def own_staging(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "staged"))
    (tmp_path / "staged").mkdir()


@pytest.mark.parametrize("cheat", CHEATS)
def test_cheat_is_caught(cheat, batch, diagnosis, tmp_path):
    body, told = CHEATS[cheat]
    ran = conceal.diagnose(batch, tmp_path / "out", sources=diagnosis(body))
    assert any(told in line for line in ran.tampering)


def test_honest_one_works_and_sees_nothing_of_us(batch, diagnosis, tmp_path):
    ran = conceal.diagnose(batch, tmp_path / "out", sources=diagnosis(HONEST))
    assert (ran.code, ran.tampering) == (0, ())
    assert (tmp_path / "out" / "diagnosis.json").read_text() == "format: 1\n"
    assert (tmp_path / "out" / "made").read_text() == "{True}"  # time stamps say nothing of how it was made
    seen = (tmp_path / "out" / "environment").read_text()
    assert str(PROOF) not in seen
    assert str(ROOT / "src") not in seen
    assert str(batch.parent / "out") not in seen


def test_a_model_in_use_and_words_reach_it(batch, diagnosis, tmp_path):
    body = """
import json, pathlib, sys
pathlib.Path("out").mkdir()
heard = sys.argv[1:] + [pathlib.Path("known.json").read_text()]
pathlib.Path("out/heard.json").write_text(json.dumps(heard))
"""
    (tmp_path / "model.json").write_text("{}")
    options = ["--allowance", "0.1"]
    conceal.diagnose(batch, tmp_path / "out", ["backlash"], diagnosis(body), options, tmp_path / "model.json")
    heard = json.loads((tmp_path / "out" / "heard.json").read_text())
    words = ["diagnose", "case-1", "--out", "out", *options, "--without", "backlash", "--beside", "known.json", "{}"]
    assert heard == words


def test_the_copy_of_the_diagnosis_is_that_of_its_sources(diagnosis):
    package = diagnosis("pass")
    first = conceal.stage(package)
    assert conceal.stage(package) == first
    (package / "cli.py").write_text("def main(): return 1\n")
    assert conceal.stage(package) != first
    assert not (first / "virtualrig").exists()


def test_models_predict_one_after_the_other_and_one_that_fails_is_told(batch, diagnosis, tmp_path):
    body = """
import pathlib, sys
model, out = pathlib.Path(sys.argv[4]), pathlib.Path(sys.argv[6])
if model.read_text() == "bad": sys.exit(1)
out.mkdir()
(out / "said").write_text(model.read_text())
"""
    for name in ("bad", "good"):
        (tmp_path / name).write_text(name)
    models = {tmp_path / name: tmp_path / f"from-{name}" for name in ("bad", "good")}
    assert conceal.predict(batch, models, diagnosis(body)).code == 1
    assert (tmp_path / "from-good" / "said").read_text() == "good"
    assert not (tmp_path / "from-bad").exists()
