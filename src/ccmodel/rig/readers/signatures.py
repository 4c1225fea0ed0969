"""Kind of a file, from its first bytes."""

import os
import re
import zlib
from pathlib import Path
from typing import NamedTuple

# Bytes at the beginning that decide. HDF5 may begin at 512 times a power of two, after a block of the user.
HEAD = 65536
_GZIP = b"\x1f\x8b"
_HDF5 = b"\x89HDF\r\n\x1a\n"
_UTF16, _UTF32 = (b"\xff\xfe", b"\xfe\xff"), (b"\xff\xfe\0\0", b"\0\0\xfe\xff")
_CONTROLS = re.compile(rb"[\x00-\x08\x0e-\x19\x1b-\x1f\x7f]")
# Share of control characters up to which a file is a text that is damaged in a place. Of random bytes it is 0.1.
_MOST_CONTROLS = 0.03


class Kind(NamedTuple):
    """A kind of file.

    Attributes
    ----------
    text : str
        With its article, for messages.
    module : str or None
        The module of this folder that reads it; None if there is none.
    advice : str
        What to do with a file of a kind that is not read; or the usual ending of one that is.
    """

    text: str
    module: str | None
    advice: str = ""


TEXT, EMPTY, UNKNOWN = Kind("text", "text", ".csv or .txt"), Kind("empty", None), Kind("not text", None)
MAT5, MAT73 = Kind("a MATLAB file (MAT v5)", "mat", ".mat"), Kind("a MATLAB file (MAT v7.3)", "mat", ".mat")
HDF5 = Kind("an HDF5 file", "hdf5", ".h5")
XLSX = Kind("an Excel workbook (xlsx)", None, "save its sheet as CSV")
_ZIP = Kind("a zip archive", None, "unpack it")
_AGAIN = "give the log itself"

_BEGINNINGS = {
    b"MATLAB 5.0 MAT": MAT5,
    b"MATLAB 7.3 MAT": MAT73,
    _HDF5: HDF5,
    b"MDF     ": Kind("an MDF file", "mdf", ".mf4"),
    b"UnFinMF ": Kind("an MDF file that was not finalised", "mdf", ".mf4"),
    b"TDSm": Kind("a TDMS file", "tdms", ".tdms"),
    b"TDSh": Kind("the index of a TDMS file", None, "give the .tdms file beside it"),
    b"PAR1": Kind("a Parquet file", "parquet", ".parquet"),
    b"#ROSBAG V2.0": Kind("a ROS 1 bag", "ros", ".bag"),
    b"#ROSBAG V1": Kind("a ROS 1 bag of the old format 1", None, "convert it with 'rosbag migrate'"),
    b"\x89MCAP0\r\n": Kind("an MCAP file (ROS 2 bag)", "ros", ".mcap"),
    b"SQLite format 3\0": Kind("an SQLite database (ROS 2 bag)", "ros", ".db3"),
    b"ARROW1": Kind("an Arrow (Feather) file", None, "save it as Parquet"),
    b"FEA1": Kind("an old Feather file", None, "save it as Parquet"),
    b"ORC": Kind("an ORC file", None, "save it as Parquet"),
    b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1": Kind("an old Excel workbook (xls)", None, "save its sheet as CSV"),
    b"CDF\x01": Kind("a classic netCDF file", None, "save it as netCDF-4 or CSV"),
    b"CDF\x02": Kind("a classic netCDF file", None, "save it as netCDF-4 or CSV"),
    b"\x93NUMPY": Kind("a NumPy array (npy)", None, "save it as CSV or MAT"),
    b"LOGG": Kind("a Vector BLF file", None, "save it as MDF4"),
    b"\x89PNG": Kind("a PNG picture", None, _AGAIN),
    b"\xff\xd8\xff": Kind("a JPEG picture", None, _AGAIN),
    b"GIF8": Kind("a GIF picture", None, _AGAIN),
    b"BZh": Kind("a bzip2 archive", None, "unpack it"),
    b"\xfd7zXZ\0": Kind("an xz archive", None, "unpack it"),
    b"\x28\xb5\x2f\xfd": Kind("a Zstandard archive", None, "unpack it"),
    b"7z\xbc\xaf\x27\x1c": Kind("a 7z archive", None, "unpack it"),
    b"Rar!": Kind("a RAR archive", None, "unpack it"),
    b"\x7fELF": Kind("a program", None, _AGAIN),
}

# Documents that are text, or may be.
_DOCUMENTS = {
    b"%PDF": Kind("a PDF document", None, _AGAIN),
    b"{\\rtf1": Kind("an RTF document", None, _AGAIN),
    b"<!DOCTYPE": Kind("a web page", None, _AGAIN),
    b"<html": Kind("a web page", None, _AGAIN),
    b"version https://git-lfs": Kind("the pointer to a file in Git LFS", None, "fetch the file with 'git lfs pull'"),
}
_SQLITE = Kind("an SQLite database without a ROS 2 bag", None, "export its table as CSV")


def kind_of(path: Path) -> Kind:
    """Kind of a file: of the first bytes, never of the name; of a gzipped file, the kind of what is inside.

    Raises
    ------
    OSError
        If the file cannot be read.
    """
    if path.is_dir():
        return _kind_of_folder(path)
    with open(path, "rb") as file:
        head = file.read(HEAD)
    if head[:2] != _GZIP:
        return kind_of_bytes(head)
    inside = kind_of_bytes(_unzipped_head(head))
    return inside if inside in (TEXT, EMPTY) else Kind(f"gzipped ({inside.text} inside)", None, "unpack it first")


def is_gzipped(path: Path) -> bool:
    """Whether a file begins as a gzip stream does."""
    with open(path, "rb") as file:
        return file.read(len(_GZIP)) == _GZIP


def kind_of_bytes(head: bytes) -> Kind:
    """Kind of a file that begins with these bytes."""
    if not head:
        return EMPTY
    # The header of a text may begin with the same letters as another format ("LOGGER;").
    known = _DOCUMENTS | _BEGINNINGS if _CONTROLS.search(head) else _DOCUMENTS
    kind = next((kind for start, kind in known.items() if head.startswith(start)), None)
    if kind and head.startswith(b"SQLite") and b"TABLE topics" not in head:
        return _SQLITE
    if kind:
        return kind
    if head.startswith(b"PK\x03\x04"):
        return XLSX if b"xl/" in head or b"[Content_Types].xml" in head[:100] else _ZIP
    if any(head[at : at + 8] == _HDF5 for at in (512, 1024, 2048, 4096)):
        return HDF5
    return TEXT if is_text(head) else UNKNOWN


def not_text(kind: Kind) -> str:
    """Message for a file of another kind where text is expected."""
    if kind.module:
        return f"is {kind.text}, not text: rename it to {kind.advice}"
    return f"is {kind.text}, not text: {kind.advice}"


def is_text(head: bytes) -> bool:
    """Whether bytes are text of an encoding that a log may have, though it may be damaged in a place."""
    if head.startswith(_UTF16 + _UTF32) or wide(head) is not None:
        return True
    return len(_CONTROLS.findall(head)) <= _MOST_CONTROLS * len(head)


def wide(head: bytes) -> str | None:
    """UTF-16 without a mark: nearly every second byte of a text of numbers is zero."""
    zeros = [head[first::2].count(0) / max(len(head) // 2, 1) for first in (0, 1)]
    if len(head) >= 4 and max(zeros) > 0.9 and min(zeros) < 0.1:
        return "utf-16-be" if zeros[0] > zeros[1] else "utf-16-le"
    return None


def _kind_of_folder(path: Path) -> Kind:
    names = os.listdir(path)
    if "metadata.yaml" in names or any(name.endswith((".db3", ".mcap")) for name in names):
        return Kind("a ROS 2 bag", "ros")
    return Kind("a folder without a ROS 2 bag", None, "give the files in it")


def _unzipped_head(head: bytes) -> bytes:
    try:
        return zlib.decompressobj(wbits=31).decompress(head, HEAD)
    except zlib.error:
        return b"damaged"  # the reader of the text says so
