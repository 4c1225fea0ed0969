"""Do the tests fail for a wrong operator, number or condition? A random sample of mutants, each with the tests.

    python -m benchmarks.mutants --count 300 --out DIR

Cosmic Ray makes the mutants of the folders in `ROOMS`, in a clone of the last commit. Of each place in the code that
has mutants one is drawn, and of the places `--count`. A mutant first meets the test files that import its module; if it
survives these, all tests of its folder. One that Python cannot compile does not count. What was tried is kept: the same
command goes on where it was stopped. At the end stands a table, and DIR/survivors.txt has the survivors as differences.
Each of them is a missing test, or changes nothing. Without a mutant all of these tests must pass first.
"""

import argparse
import random
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path

from cosmic_ray.work_db import WorkDB, use_db
from cosmic_ray.work_item import TestOutcome, WorkItem

ROOT = Path(__file__).parents[1]
ROOMS = ("model", "inference", "rig", "diagnosis", "accuracy", "studies")
# Folders of tests of a room, where not only the one of its name: the general solver is tested by what mechanisms do.
TESTS = {"model": ("tests/model", "tests/mechanisms")}
# A union of types in an annotation is no calculation.
NO_MUTANTS = re.compile("BitOr|BitXor|BitAnd")
# Without those of `make long-tests`, which would take hours.
PYTEST = ("-m", "pytest", "-x", "-q", "-m", "not long", "-p", "no:cacheprovider")
TIMEOUT_S = 900
CONFIG = """[cosmic-ray]
module-path = [{modules}]
timeout = {timeout}
excluded-modules = []
test-command = "{python} -m benchmarks.mutants --test"
[cosmic-ray.distributor]
name = "local"
"""


def files_for(module: Path, tree: Path = Path()) -> list[list[str]]:
    """Tests of a module, in the order in which they are run: those that import it, and those of its folder."""
    name = ".".join(module.relative_to("src").with_suffix("").parts).removesuffix(".__init__")
    imports = re.compile(rf"\b{re.escape(name)}\b|from {re.escape(name.rpartition('.')[0])} import .*\b{module.stem}\b")
    files = sorted((tree / "tests").rglob("test_*.py"))
    direct = [str(file.relative_to(tree)) for file in files if imports.search(file.read_text(encoding="utf-8"))]
    return [some for some in (direct, [*TESTS.get(module.parts[2], (f"tests/{module.parts[2]}",))]) if some]


def test() -> int:
    """Run the tests of the one file that differs from the commit; the exit code of the first run that fails."""
    changed = subprocess.run(["git", "diff", "--name-only"], capture_output=True, text=True, check=True).stdout.split()
    for some in files_for(Path(changed[0])) if changed else [["tests/test_elementary.py"]]:
        found = subprocess.run([sys.executable, *PYTEST, *some])
        if found.returncode:
            return found.returncode
    return 0


def prepare(out: Path, count: int, seed: int) -> None:
    """A clone of the last commit and a session with the drawn mutants, unless they are there."""
    if (out / "session.sqlite").exists():
        return
    tree = out / "tree"
    subprocess.run(["git", "clone", "-q", str(ROOT), str(tree)], check=True)
    modules = ", ".join(f'"src/ccmodel/{room}"' for room in ROOMS)
    config = CONFIG.format(modules=modules, timeout=TIMEOUT_S, python=sys.executable)
    (tree / "mutants.toml").write_text(config, encoding="utf-8")
    run_in(tree, "-m", "cosmic_ray.cli", "init", "mutants.toml", "new.sqlite")
    with use_db(tree / "new.sqlite", WorkDB.Mode.open) as every:
        drawn = sample(every.work_items, count, seed)
    modules = {item.mutations[0].module_path for item in drawn}
    files = sorted({file for module in modules for some in files_for(module, tree) for file in some})
    run_in(tree, *PYTEST, *files)
    with use_db(out / "new.sqlite", WorkDB.Mode.create) as session:
        session.add_work_items(drawn)
    (out / "new.sqlite").rename(out / "session.sqlite")


def sample(items: tuple[WorkItem, ...], count: int, seed: int) -> list[WorkItem]:
    """Some mutants, one at each of `count` places."""
    at: dict[tuple, list[WorkItem]] = {}
    for item in items:
        (mutation,) = item.mutations
        if not NO_MUTANTS.search(mutation.operator_name):
            at.setdefault((str(mutation.module_path), mutation.start_pos), []).append(item)
    draw = random.Random(seed)
    places = draw.sample(sorted(at), min(count, len(at)))
    return [draw.choice(sorted(at[place], key=_what_it_does)) for place in places]


def _what_it_does(item: WorkItem) -> tuple[str, int, str]:
    """A mutant without its id, which is new in each session."""
    (mutation,) = item.mutations
    return mutation.operator_name, mutation.occurrence, str(mutation.operator_args)


def run_in(tree: Path, *arguments: str) -> None:
    """Run Python in a clone, whose code is imported."""
    path = {"PYTHONPATH": f"{tree / 'src'}:{tree}", "PATH": str(Path(sys.executable).parent) + ":/usr/bin:/bin"}
    subprocess.run([sys.executable, *arguments], cwd=tree, env=path, check=True)


def main() -> None:
    """Try what was not tried, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--test", action="store_true", help="run the tests of the file that differs (Cosmic Ray does)")
    asked = parser.parse_args()
    if asked.test:
        sys.exit(test())
    out = asked.out.resolve()
    prepare(out, asked.count, asked.seed)
    # A mutant that was being tried when an earlier run was stopped is still in the file.
    subprocess.run(["git", "checkout", "-q", "src"], cwd=out / "tree", check=True)
    run_in(out / "tree", "-m", "cosmic_ray.cli", "exec", "mutants.toml", str(out / "session.sqlite"))
    report(out)


def report(out: Path) -> None:
    """The table of what was tried so far, and the survivors."""
    died, tried, survivors = Counter[str](), Counter[str](), []
    with use_db(out / "session.sqlite", WorkDB.Mode.open) as session:
        for item, result in session.completed_work_items:
            if "SyntaxError: " in (result.output or ""):
                continue
            room = item.mutations[0].module_path.parts[2]
            tried[room] += 1
            if result.test_outcome == TestOutcome.SURVIVED:
                survivors.append(result.diff or "")
            else:
                died[room] += 1
    for room in sorted(tried):
        print(f"{room:12s} {died[room]} of {tried[room]} died")
    print(f"{'all':12s} {died.total()} of {tried.total()} died")
    (out / "survivors.txt").write_text("\n\n".join(survivors), encoding="utf-8")


if __name__ == "__main__":
    main()
