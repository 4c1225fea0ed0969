"""Prepare the folder of a run: `prepare.py FOLDER BATCH...`, or `prepare.py FOLDER all` for the default run."""

import sys
from pathlib import Path

import yaml

ROOT = Path(__file__).parents[2]
# What the paper's claims and the accepted accuracy are compared with, and what the rigs conceal, need all batches.
OF_ALL_BATCHES = ("claims", "baseline", "concealed")


def prepare(folder: Path, batches: list[str]) -> None:
    """Give a folder the raw data of the batches, and a configuration reduced to them."""
    config = yaml.safe_load((ROOT / "config/config.yaml").read_text())
    known = sorted(path.name for path in (ROOT / "data/raw").iterdir())
    if batches == ["all"]:
        batches = known
        _link(folder / "config", ROOT / "config")
        _link(folder / config["concealed"], ROOT / config["concealed"])
    else:
        config = {key: value for key, value in config.items() if key not in OF_ALL_BATCHES}
        for of_batch in ("studies", "fits"):
            config[of_batch] = {n: s for n, s in config[of_batch].items() if set(s["batches"]) <= set(batches)}
        config["rigs"] = {
            rig: [b for b in of if b in batches] for rig, of in config["rigs"].items() if set(of) & set(batches)
        }
        config["diagnosing_by_batch"] = {b: s for b, s in config["diagnosing_by_batch"].items() if b in batches}
    for batch in batches:
        _link(folder / config["raw"] / batch, ROOT / "data/raw" / batch)
    (folder / "config.yaml").write_text(yaml.safe_dump(config))


def _link(path: Path, target: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    if not path.is_symlink():
        path.symlink_to(target)


if __name__ == "__main__":
    prepare(Path(sys.argv[1]), sys.argv[2:])
