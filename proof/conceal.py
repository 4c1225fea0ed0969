"""The diagnosis as a process that can reach the batch and nothing else."""

import hashlib
import json
import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy

from proof.build import folder_digest

SOURCES = Path(__file__).parents[1] / "src" / "ccmodel"
GUARD = Path(__file__).with_name("guard.py")
BUILDER = (
    "proof.yaml",
    "plan.py",
    "cases.py",
    "build.py",
    "judge.py",
    "measured.py",
    "conceal.py",
    "guard.py",
)
TIMEOUT_S = 1800
# Where libraries keep data, and devices such as /dev/urandom; no home, no folder that this project is in.
SYSTEM = (
    "/usr/share",
    "/usr/lib",
    "/lib",
    "/lib64",
    "/etc",
    "/dev",
    "/proc/cpuinfo",
    "/proc/self",
    "/proc/meminfo",
    "/sys",
)


@dataclass(frozen=True)
class Ran:
    """How a concealed command ended.

    Attributes
    ----------
    code : int
        Its exit code.
    said : str
        The end of what it said on standard error.
    tampering : tuple of str
        What it tried to reach, one line each; the case is refused where there is any.
    """

    code: int
    said: str
    tampering: tuple[str, ...]


def digest_of(sources: Path = SOURCES) -> str:
    """Digest of every file of a package, compiled ones aside."""
    digest = hashlib.sha256()
    for file in sorted(f for f in sources.rglob("*") if f.is_file() and "__pycache__" not in f.parts):
        digest.update(str(file.relative_to(sources)).encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()[:16]


def builder_digest() -> str:
    """Digest of all that makes a case and its result: the rig, the plan, and the way from there to here."""
    files = [Path(__file__).with_name(name) for name in BUILDER]
    parts = [digest_of(SOURCES.with_name("virtualrig")).encode(), *(file.read_bytes() for file in files)]
    return hashlib.sha256(b"\0".join(parts)).hexdigest()[:8]


def made_by(sources: Path = SOURCES) -> dict[str, str]:
    """What tells a result of this diagnosis and of these cases from any other, under the names that it has there."""
    return {"sources": digest_of(sources), "builder": builder_digest()}


def stage(sources: Path = SOURCES) -> Path:
    """A copy of the diagnosis's package alone, in a folder that goes by its digest, so that it compiles once."""
    staged = Path(tempfile.gettempdir()) / f"ccmodel-alone-{os.getuid()}" / digest_of(sources)
    if not staged.exists():
        fresh = Path(tempfile.mkdtemp(dir=_made(staged.parent)))
        # With what is compiled already: that knows its sources by their time stamps, which are kept.
        shutil.copytree(sources, fresh / "ccmodel")
        (fresh / "caches").mkdir()
        # Another process may have been faster; its copy is the same.
        try:
            fresh.rename(staged)
        except OSError:
            shutil.rmtree(fresh)
    return staged


def run(commands: Sequence[Sequence[str]], folder: Path, sources: Path = SOURCES) -> Ran:
    """Run ccmodel commands, one after the other in one process, with `folder` as its whole world.

    Parameters
    ----------
    commands : sequence of sequence of str
        Arguments of each; paths in them are relative to `folder`.
    folder : Path
        Holds the batch and takes the results.
    sources : Path
        The package that is run.
    """
    staged = stage(sources)
    hears, tells = os.pipe()
    scratch = _made(folder / "scratch")
    libraries = sorted({str(Path(numpy.__file__).parents[1]), sysconfig.get_path("purelib")})
    standard = [sysconfig.get_path("stdlib"), os.path.join(sysconfig.get_path("stdlib"), "lib-dynload")]
    told = {
        "standard": standard,
        "path": [str(staged), *libraries],
        "readable": [*standard, *libraries, *SYSTEM],
        "writable": [str(staged), str(folder)],
        "commands": list(map(list, commands)),
        "tell": tells,
    }
    environment = {
        "PATH": "/usr/bin:/bin",
        "LANG": "C.UTF-8",
        "HOME": str(scratch),
        "TMPDIR": str(scratch),
        "MPLCONFIGDIR": str(staged / "caches"),
        "MPLBACKEND": "agg",
    }
    with os.fdopen(hears, "rb") as heard:
        try:
            done = subprocess.run(
                [sys.executable, "-I", "-S", str(GUARD), json.dumps(told)],
                cwd=folder,
                env=environment,
                pass_fds=[tells],
                capture_output=True,
                timeout=TIMEOUT_S,
            )
            code, said = done.returncode, done.stderr.decode(errors="replace")
        except subprocess.TimeoutExpired:
            code, said = -1, f"took longer than {TIMEOUT_S} s"
        finally:
            os.close(tells)
            shutil.rmtree(scratch, ignore_errors=True)
        tampering = heard.read().decode(errors="replace").splitlines()
    return Ran(code, said[-2000:], tuple(dict.fromkeys(tampering)))


def core_s() -> float:
    """Seconds that this process and those it waited for have spent on a core: however busy the machine is."""
    return sum(os.times()[:4])


def diagnose(
    batch: Path,
    out: Path,
    without: Sequence[str] = (),
    sources: Path = SOURCES,
    options: Sequence[str] = (),
    beside: Path | None = None,
) -> Ran:
    """Diagnose a copy of a batch in an otherwise empty folder; results are brought to `out`.

    Parameters
    ----------
    batch, out : Path
    without : sequence of str
        Mechanisms that are taken off the list.
    sources : Path
        The diagnosis's package.
    options : sequence of str
        Further words of the command; they name no file.
    beside : Path, optional
        A model file that the folder gets besides the batch: asked is what is missing besides what it has.
    """
    before = folder_digest(batch)
    with tempfile.TemporaryDirectory(prefix="batch-") as folder:
        world = Path(folder)
        # Without their time stamps: how long each took to make is no business of the diagnosis.
        shutil.copytree(batch, world / batch.name, copy_function=shutil.copyfile)
        words = [*options, *(word for name in without for word in ("--without", name))]
        if beside is not None:
            shutil.copy(beside, world / "known.json")
            words += ["--beside", "known.json"]
        ran = run([["diagnose", batch.name, "--out", "out", *words]], world, sources)
        altered = ("altered the batch",) if folder_digest(world / batch.name) != before else ()
        if (world / "out").exists():
            shutil.copytree(world / "out", out, dirs_exist_ok=True)
    return Ran(ran.code, ran.said, ran.tampering + altered)


def predict(blinded: Path, models: Mapping[Path, Path], sources: Path = SOURCES) -> Ran:
    """Predict a batch with model files in an otherwise empty folder; predictions are brought to the folder of each.

    Parameters
    ----------
    blinded : Path
        The batch.
    models : mapping of Path to Path
        Model files, and the folders that get what they say.
    sources : Path
        The diagnosis's package.
    """
    with tempfile.TemporaryDirectory(prefix="batch-") as folder:
        world = Path(folder)
        shutil.copytree(blinded, world / blinded.name, copy_function=shutil.copyfile)
        commands = []
        for k, model in enumerate(models):
            shutil.copyfile(model, world / f"model-{k}.json")
            commands.append(["predict", blinded.name, "--model", f"model-{k}.json", "--out", f"out-{k}"])
        ran = run(commands, world, sources)
        for k, out in enumerate(models.values()):
            if (world / f"out-{k}").exists():
                shutil.copytree(world / f"out-{k}", out, dirs_exist_ok=True)
    return ran


def _made(folder: Path) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    return folder
