"""What the compressed parts of ROS bags unpack to, counted before the library reads them."""

import bz2
import struct
from collections.abc import Callable
from contextlib import suppress
from io import SEEK_CUR
from pathlib import Path
from typing import Any, BinaryIO

from ccmodel.rig.readers.content import Unpacked

# Bytes that are unpacked at a time.
_PIECE = 1 << 20
_BAG, _MCAP, _ZSTD = b"#ROSBAG V2.0\n", b"\x89MCAP0\r\n", b"\x28\xb5\x2f\xfd"
# Records of chunks and of the end of a file.
_BAG_CHUNK, _MCAP_CHUNK, _MCAP_FOOTER = b"\x05", 6, 2


def count(path: Path) -> None:
    """Raise `LogError` if the chunks of a bag, or the files in its folder, unpack to more than the limit.

    Nothing of it is kept. What cannot be unpacked is left to the library, which says what is wrong.

    Raises
    ------
    ValueError
        If a record is longer than the file.
    """
    unpacked = Unpacked()
    for one in sorted(path.iterdir()) if path.is_dir() else [path]:
        if one.is_file():
            with one.open("rb") as file:
                _count_file(file, one.stat().st_size, unpacked)


def count_packed(packed: bytes, compression: str, unpacked: Unpacked) -> None:
    """Count what bytes unpack to; `compression` is "bz2", "lz4" or "zstd", and others are left to the library."""
    make = _decompressor(compression)
    # Each library has an error of its own for bytes that are no stream.
    with suppress(OSError, RuntimeError, EOFError, _zstd().ZstdError):
        while packed and make:
            stream = make()
            unpacked.add(len(stream.decompress(packed, _PIECE)))
            while not stream.eof and not stream.needs_input:
                unpacked.add(len(stream.decompress(b"", _PIECE)))
            packed = stream.unused_data or b""


def _count_file(file: BinaryIO, size: int, unpacked: Unpacked) -> None:
    head = file.read(len(_BAG))
    if head == _BAG:
        _count_bag(file, size, unpacked)
    elif head.startswith(_MCAP):
        file.seek(len(_MCAP))
        _count_mcap(file, size, unpacked)
    elif head.startswith(_ZSTD):
        file.seek(0)
        count_packed(file.read(), "zstd", unpacked)


def _count_bag(file: BinaryIO, size: int, unpacked: Unpacked) -> None:
    while file.tell() < size:
        header = _fields(file.read(_within(file, size, "<I")))
        length = _within(file, size, "<I")
        if header.get(b"op") == _BAG_CHUNK and header.get(b"compression", b"none") != b"none":
            count_packed(file.read(length), header[b"compression"].decode(errors="replace"), unpacked)
        else:
            file.seek(length, SEEK_CUR)


def _fields(header: bytes) -> dict[bytes, bytes]:
    """Fields of the header of a record of a ROS 1 bag."""
    fields, at = {}, 0
    while at + 4 <= len(header):
        length = struct.unpack_from("<I", header, at)[0]
        name, _, value = header[at + 4 : at + 4 + length].partition(b"=")
        fields[name] = value
        at += 4 + length
    return fields


def _count_mcap(file: BinaryIO, size: int, unpacked: Unpacked) -> None:
    while (kind := file.read(1)) and kind[0] != _MCAP_FOOTER:
        length = _within(file, size, "<Q")
        if kind[0] != _MCAP_CHUNK:
            file.seek(length, SEEK_CUR)
            continue
        chunk = file.read(length)
        # Times of the first and last message, size and checksum of what is inside.
        at = 28
        name_size = struct.unpack_from("<I", chunk, at)[0]
        compression = chunk[at + 4 : at + 4 + name_size].decode(errors="replace")
        count_packed(chunk[at + 4 + name_size + 8 :], compression, unpacked)


def _within(file: BinaryIO, size: int, code: str) -> int:
    """A length that stands in a file, if the file is that long."""
    raw = file.read(struct.calcsize(code))
    length = struct.unpack(code, raw)[0] if len(raw) == struct.calcsize(code) else size
    if length > size - file.tell():
        raise ValueError("a record is longer than the file")
    return int(length)


def _decompressor(compression: str) -> Callable[[], Any] | None:
    from lz4.frame import LZ4FrameDecompressor

    return {"bz2": bz2.BZ2Decompressor, "lz4": LZ4FrameDecompressor, "zstd": _zstd().ZstdDecompressor}.get(compression)


def _zstd() -> Any:
    """The module of the standard library, or the one that stands in for it before Python 3.14."""
    try:
        from compression import zstd
    except ImportError:
        from backports import zstd
    return zstd
