"""Runs the diagnosis as a process that can reach its batch and nothing else."""

import hashlib
import json
import os
import shutil
import stat
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
# Files that determine a case and its result.
BUILDER = (
    "proof.yaml",
    "plan.py",
    "cases.py",
    "rig_draw.py",
    "recording_draw.py",
    "build.py",
    "judge.py",
    "measured.py",
    "conceal.py",
    "guard.py",
    "follow_up.py",
    "regressors.py",
)
TIMEOUT_S = 1800
# Data of libraries, and devices such as /dev/urandom. No home folder, and no folder that holds this project.
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
class Completed:
    """How a concealed command ended.

    Attributes
    ----------
    code : int
        Exit code; -1 after a timeout.
    stderr : str
        The last 2000 characters of standard error.
    tampering : tuple of str
        Accesses that were refused, one line each. A case with any is not counted.
    """

    code: int
    stderr: str
    tampering: tuple[str, ...]

    @property
    def is_usable(self) -> bool:
        """Whether the command succeeded without tampering."""
        return self.code == 0 and not self.tampering

    @property
    def failure(self) -> str:
        """Exit code and the end of standard error, for a result."""
        return f"exit code {self.code}: {self.stderr.strip()[-500:]}"


def digest_of(sources: Path = SOURCES) -> str:
    """First 16 digits of the SHA-256 of a package's files, compiled files excluded."""
    digest = hashlib.sha256()
    for file in sorted(f for f in sources.rglob("*") if f.is_file() and "__pycache__" not in f.parts):
        digest.update(str(file.relative_to(sources)).encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()[:16]


def builder_digest() -> str:
    """First 8 digits of the SHA-256 of everything that determines a case and its result, the virtual rig included."""
    files = [Path(__file__).with_name(name) for name in BUILDER]
    parts = [digest_of(SOURCES.with_name("virtualrig")).encode(), *(file.read_bytes() for file in files)]
    return hashlib.sha256(b"\0".join(parts)).hexdigest()[:8]


def made_by(sources: Path = SOURCES) -> dict[str, str]:
    """Digests of the diagnosis and of the builder, under their keys in a result."""
    return {"sources": digest_of(sources), "builder": builder_digest()}


def stage(sources: Path = SOURCES) -> Path:
    """Copy the diagnosis's package to a folder named by its digest, so that each version is compiled once.

    Returns
    -------
    Path
        The folder that holds the copy.

    Raises
    ------
    PermissionError
        If the folder of all copies is another user's, or another user may write there.
    """
    staged = _own(Path(tempfile.gettempdir()) / f"ccmodel-alone-{os.getuid()}") / digest_of(sources)
    if not staged.exists():
        fresh = Path(tempfile.mkdtemp(dir=staged.parent))
        # Compiled files are copied too. They recognise their sources by time stamps, which copytree keeps.
        shutil.copytree(sources, fresh / "ccmodel")
        (fresh / "caches").mkdir()
        # If another process staged the same sources first, its copy is used.
        try:
            fresh.rename(staged)
        except OSError:
            shutil.rmtree(fresh)
    return staged


def run(commands: Sequence[Sequence[str]], folder: Path, sources: Path = SOURCES) -> Completed:
    """Run ccmodel commands in sequence in one process that can read and write only `folder`.

    Parameters
    ----------
    commands : sequence of sequence of str
        Arguments of each command; paths are relative to `folder`.
    folder : Path
        Holds the batch and receives the results.
    sources : Path
        The package to run.
    """
    staged = stage(sources)
    scratch = _made(folder / "scratch")
    # A file, since a pipe that nobody reads stops the process after some hundred reports.
    with tempfile.TemporaryFile() as report:
        settings = _guard_settings(commands, folder, staged, report.fileno())
        try:
            done = subprocess.run(
                # -B: compiled copies of libraries would be written outside of the folder.
                [sys.executable, "-I", "-S", "-B", str(GUARD), json.dumps(settings)],
                cwd=folder,
                env=_environment(scratch, staged),
                pass_fds=[report.fileno()],
                capture_output=True,
                timeout=TIMEOUT_S,
            )
            code, stderr = done.returncode, done.stderr.decode(errors="replace")
        except subprocess.TimeoutExpired:
            code, stderr = -1, f"took longer than {TIMEOUT_S} s"
        finally:
            shutil.rmtree(scratch, ignore_errors=True)
        report.seek(0)
        tampering = report.read().decode(errors="replace").splitlines()
    return Completed(code, stderr[-2000:], tuple(dict.fromkeys(tampering)))


def _guard_settings(commands: Sequence[Sequence[str]], folder: Path, staged: Path, report_fd: int) -> dict:
    """Argument of `proof.guard.main`."""
    libraries = sorted({str(Path(numpy.__file__).parents[1]), sysconfig.get_path("purelib")})
    standard = [sysconfig.get_path("stdlib"), os.path.join(sysconfig.get_path("stdlib"), "lib-dynload")]
    return {
        "standard": standard,
        "path": [str(staged), *libraries],
        "readable": [*standard, *libraries, *SYSTEM],
        "writable": [str(staged), str(folder)],
        "commands": list(map(list, commands)),
        "report_fd": report_fd,
    }


def _environment(scratch: Path, staged: Path) -> dict[str, str]:
    return {
        "PATH": "/usr/bin:/bin",
        "LANG": "C.UTF-8",
        "HOME": str(scratch),
        "TMPDIR": str(scratch),
        "MPLCONFIGDIR": str(staged / "caches"),
        "MPLBACKEND": "agg",
    }


def core_s() -> float:
    """Processor time of this process and of those it has waited for, s. It does not depend on the machine's load."""
    return sum(os.times()[:4])


def diagnose(
    batch: Path,
    out: Path,
    without: Sequence[str] = (),
    sources: Path = SOURCES,
    options: Sequence[str] = (),
    baseline: Path | None = None,
) -> Completed:
    """Diagnose a copy of a batch in an otherwise empty folder, and copy the results to `out`.

    Parameters
    ----------
    batch, out : Path
    without : sequence of str
        Mechanisms removed from the candidates.
    sources : Path
        The diagnosis's package.
    options : sequence of str
        Further command-line options; they name no file.
    baseline : Path, optional
        Model file of the baseline, which is copied beside the batch.
    """
    before = folder_digest(batch)
    with tempfile.TemporaryDirectory(prefix="batch-") as folder:
        world = Path(folder)
        # Time stamps are not copied: they would show how long each file took to make.
        shutil.copytree(batch, world / batch.name, copy_function=shutil.copyfile)
        # No verdict depends on the clock: the time limit is that of the process.
        arguments = [*options, "--time-limit", str(TIMEOUT_S)]
        arguments += [argument for name in without for argument in ("--without", name)]
        if baseline is not None:
            shutil.copy(baseline, world / "baseline.json")
            arguments += ["--baseline", "baseline.json"]
        completed = run([["diagnose", batch.name, "--out", "out", *arguments]], world, sources)
        altered = ("altered the batch",) if folder_digest(world / batch.name) != before else ()
        if (world / "out").exists():
            shutil.copytree(world / "out", out, dirs_exist_ok=True)
    return Completed(completed.code, completed.stderr, completed.tampering + altered)


def predict(blinded: Path, models: Mapping[Path, Path], sources: Path = SOURCES) -> Completed:
    """Predict a batch with several models in an otherwise empty folder.

    Parameters
    ----------
    blinded : Path
        The batch.
    models : mapping of Path to Path
        Model file to the folder that gets its predictions.
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
        completed = run(commands, world, sources)
        for k, out in enumerate(models.values()):
            if (world / f"out-{k}").exists():
                shutil.copytree(world / f"out-{k}", out, dirs_exist_ok=True)
    return completed


def _own(folder: Path) -> Path:
    """A folder of this user that nobody else writes to: its name is known, and code in it is run."""
    folder.mkdir(mode=0o700, exist_ok=True)
    found = folder.lstat()
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.getuid() or found.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        raise PermissionError(f"{folder}: is not this user's alone: remove it, or set TMPDIR to another folder")
    return folder


def _made(folder: Path) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    return folder
