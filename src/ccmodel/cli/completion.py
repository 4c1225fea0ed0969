"""What a shell proposes for an argument that is not finished; cheap, as it runs at every press of the key."""

from pathlib import Path


def batch_folders(incomplete: str) -> list[str]:
    """Folders of batches that begin like this; otherwise folders to look into."""
    head, slash, begin = incomplete.rpartition("/")
    folder = Path(head + slash) if slash else Path()
    if not folder.is_dir():
        return []
    folders = sorted(f.name for f in folder.iterdir() if f.is_dir() and f.name.startswith(begin))
    shown = [name for name in folders if begin or not name.startswith(".")]
    return [f"{head}{slash}{n}" if (folder / n / "batch.yaml").exists() else f"{head}{slash}{n}/" for n in shown]


def mechanisms(incomplete: str) -> list[str]:
    """Names of mechanisms that begin like this."""
    from ccmodel.mechanisms import names

    return [name for name in names() if name.startswith(incomplete)]


def candidates(incomplete: str) -> list[str]:
    """Mechanisms at their places, as ``kink at conduit``; the second of two follows a comma."""
    from ccmodel.mechanisms import get, names

    first, comma, begin = incomplete.rpartition(",")
    every = [f"{name} at {place}" for name in names() for place in get(name).places]
    return [first + comma + one for one in every if one.startswith(begin)]
