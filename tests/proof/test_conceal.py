"""A diagnosis that looks for the answer is refused; an honest one is not."""

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
    """Call with a function body: a package whose command it is."""

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
def test_tampering_is_reported(cheat, batch, diagnosis, tmp_path):
    body, message = CHEATS[cheat]
    ran = conceal.diagnose(batch, tmp_path / "out", sources=diagnosis(body))
    assert any(message in line for line in ran.tampering)


def test_any_number_of_refusals_is_reported(batch, diagnosis, tmp_path, monkeypatch):
    """More than a pipe holds."""
    monkeypatch.setattr(conceal, "TIMEOUT_S", 60)
    body = "for k in range(5000):\n    try:\n        open(f'/var/tmp/note-{k}', 'w')\n    except OSError:\n        pass"
    ran = conceal.diagnose(batch, tmp_path / "out", sources=diagnosis(body))
    assert (ran.code, len(ran.tampering)) == (0, 5000)


def test_an_honest_diagnosis_works_and_learns_nothing_of_the_project(batch, diagnosis, tmp_path):
    ran = conceal.diagnose(batch, tmp_path / "out", sources=diagnosis(HONEST))
    assert (ran.code, ran.tampering) == (0, ())
    assert (tmp_path / "out" / "diagnosis.json").read_text() == "format: 1\n"
    assert (tmp_path / "out" / "made").read_text() == "{True}"  # time stamps do not reveal how it was made
    seen = (tmp_path / "out" / "environment").read_text()
    assert str(PROOF) not in seen
    assert str(ROOT / "src") not in seen
    assert str(batch.parent / "out") not in seen


def test_the_baseline_and_the_options_reach_it(batch, diagnosis, tmp_path):
    body = """
import json, pathlib, sys
pathlib.Path("out").mkdir()
received = sys.argv[1:] + [pathlib.Path("baseline.json").read_text()]
pathlib.Path("out/received.json").write_text(json.dumps(received))
"""
    (tmp_path / "model.json").write_text("{}")
    options = ["--tolerance", "0.1"]
    conceal.diagnose(batch, tmp_path / "out", ["backlash"], diagnosis(body), options, tmp_path / "model.json")
    received = json.loads((tmp_path / "out" / "received.json").read_text())
    # The clock ends no diagnosis before its process.
    limit = ["--time-limit", str(conceal.TIMEOUT_S)]
    arguments = ["diagnose", "case-1", "--out", "out", *options, *limit, "--without", "backlash"]
    assert received == [*arguments, "--baseline", "baseline.json", "{}"]


def test_the_staged_package_follows_its_sources(diagnosis):
    package = diagnosis("pass")
    first = conceal.stage(package)
    assert conceal.stage(package) == first
    (package / "cli.py").write_text("def main(): return 1\n")
    assert conceal.stage(package) != first
    assert not (first / "virtualrig").exists()


def test_code_is_staged_in_no_folder_of_another_user(diagnosis, tmp_path, monkeypatch):
    package = diagnosis("pass")
    monkeypatch.setattr(conceal.tempfile, "gettempdir", lambda: str(tmp_path))
    place = conceal.stage(package).parent
    assert place.parent == tmp_path and place.stat().st_mode & 0o777 == 0o700
    place.chmod(0o777)
    with pytest.raises(PermissionError, match="is not this user's alone"):
        conceal.stage(package)
    place.rename(tmp_path / "elsewhere")
    place.symlink_to(tmp_path / "elsewhere")
    (tmp_path / "elsewhere").chmod(0o700)
    with pytest.raises(PermissionError, match="is not this user's alone"):
        conceal.stage(package)


def test_models_predict_in_sequence_and_a_failure_sets_the_exit_code(batch, diagnosis, tmp_path):
    body = """
import pathlib, sys
model, out = pathlib.Path(sys.argv[4]), pathlib.Path(sys.argv[6])
if model.read_text() == "bad": sys.exit(1)
out.mkdir()
(out / "text").write_text(model.read_text())
"""
    for name in ("bad", "good"):
        (tmp_path / name).write_text(name)
    models = {tmp_path / name: tmp_path / f"from-{name}" for name in ("bad", "good")}
    assert conceal.predict(batch, models, diagnosis(body)).code == 1
    assert (tmp_path / "from-good" / "text").read_text() == "good"
    assert not (tmp_path / "from-bad").exists()
