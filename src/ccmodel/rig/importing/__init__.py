"""Import of logs in any format: a map says what each column is made of (`docs/how-to/import-logs.md`)."""

from ccmodel.rig.importing.draft import GuessedMap, write_guess
from ccmodel.rig.importing.showing import guess_tables, import_tables, next_of_guess, next_of_import
from ccmodel.rig.importing.writing import Written, import_files

__all__ = [
    "GuessedMap",
    "Written",
    "guess_tables",
    "import_files",
    "import_tables",
    "next_of_guess",
    "next_of_import",
    "write_guess",
]
