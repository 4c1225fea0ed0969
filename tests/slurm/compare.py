"""Compare the results of two runs: `compare.py FOLDER OTHER`; exits with 1 if a result differs.

Files are compared byte by byte. Of JSON files that differ, the values are compared without the processor time that a
case took.
"""

import json
import sys
from pathlib import Path

NOT_RESULTS = ("logs", "benchmarks")
TIMES = {"diagnosis_s", "took_s"}
# A line of the score on such times, by its first words.
TIME_IN_SCORE = "processor time "


def results(folder: Path) -> dict[str, Path]:
    """Files of a run by their names, without logs and measured times."""
    files = {str(file.relative_to(folder)): file for file in folder.rglob("*") if file.is_file()}
    return {name: file for name, file in files.items() if not set(NOT_RESULTS) & set(Path(name).parts)}


def without_times(content: object) -> object:
    """Content of a JSON file without measured times."""
    if isinstance(content, dict):
        if str(content.get("what", "")).startswith(TIME_IN_SCORE):
            return content["what"]
        return {key: without_times(value) for key, value in content.items() if key not in TIMES}
    return [without_times(value) for value in content] if isinstance(content, list) else content


def are_equal(one: Path, other: Path) -> bool:
    """Whether two files are equal but for measured times."""
    if one.suffix != ".json":
        return False
    return without_times(json.loads(one.read_text())) == without_times(json.loads(other.read_text()))


def compare(folder: Path, other: Path) -> int:
    """Print which results are the same; the number of results that are not."""
    one, two = results(folder), results(other)
    common = sorted(one.keys() & two.keys())
    if not common:
        sys.exit(f"{folder} and {other} have no result in common")
    changed = [name for name in common if one[name].read_bytes() != two[name].read_bytes()]
    different = [name for name in changed if not are_equal(one[name], two[name])]
    different += sorted(one.keys() ^ two.keys())
    print(f"{len(common) - len(changed)} of {len(common)} files are equal byte by byte")
    for name in changed:
        if name not in different:
            print(f"equal but for times: {name}")
    for name in different:
        print(f"differs: {name}", file=sys.stderr)
    return len(different)


if __name__ == "__main__":
    sys.exit(1 if compare(Path(sys.argv[1]), Path(sys.argv[2])) else 0)
