"""The logs that an import has written into the folder of a batch, and those of them that `batch.yaml` leaves out."""

from collections.abc import Iterable
from os.path import normpath
from pathlib import Path

from pydantic import BaseModel

from ccmodel.paths import BATCH_FILE
from ccmodel.typed import load_json_model, load_yaml_model

PROVENANCE = "import.json"


class _Log(BaseModel):
    id: str
    file: str
    sha256: str = ""


class Import(BaseModel):
    """What is read of `import.json`.

    Attributes
    ----------
    recordings : list
        Id, file and digest of each log.
    draft_sha256 : str or None
        Digest of the `batch.yaml` that an import drafted, as it drafted it; None if none did.
    """

    recordings: list[_Log]
    draft_sha256: str | None = None


class _Entry(BaseModel):
    file: str


class _Listed(BaseModel):
    """What is read of a `batch.yaml` that may not be filled in yet."""

    recordings: list[_Entry] = []


def earlier_import(folder: Path) -> Import | None:
    """What the last import into a folder wrote; None without an import.

    Raises
    ------
    InputError
        If `import.json` is not one.
    """
    file = folder / PROVENANCE
    return load_json_model(file, Import, "an import") if file.exists() else None


def imported_logs(folder: Path) -> dict[str, str]:
    """Files of the logs that an import has written to a folder, by id of the recording; none without an import.

    Raises
    ------
    InputError
        If `import.json` is not one.
    """
    found = earlier_import(folder)
    return {log.id: log.file for log in found.recordings} if found else {}


def listed_files(folder: Path) -> list[str]:
    """Files of the recordings in a `batch.yaml`, filled in or not.

    Raises
    ------
    InputError
        If it cannot be read.
    """
    return [entry.file for entry in load_yaml_model(folder / BATCH_FILE, _Listed).recordings]


def unlisted_logs(folder: Path, listed: Iterable[str]) -> dict[str, str]:
    """Imported logs that are in the folder and not among the listed files, by id of the recording.

    Raises
    ------
    InputError
        If `import.json` is not one.
    """
    known = {normpath(file) for file in listed}
    imported = imported_logs(folder)
    return {id_: file for id_, file in imported.items() if normpath(file) not in known and (folder / file).is_file()}
