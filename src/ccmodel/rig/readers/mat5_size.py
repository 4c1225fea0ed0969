"""What the elements of a MATLAB v5 file unpack to and declare, counted before the library reads them."""

import io
import math
import struct
import zlib
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO

import numpy as np

from ccmodel.rig.readers.content import Unpacked

# Bytes of the header of a file and of the tag of an element; types of an array and of a compressed element.
_HEADER, _TAG, _ARRAY, _COMPRESSED = 128, 8, 14, 15
_CELL, _STRUCT, _OBJECT, _CHAR = 1, 2, 3, 4
# Bytes of an element in memory, of the classes whose arrays may be declared longer than the file is, since an element
# may take no byte there: an empty array or struct of Python, or a character of a text.
ELEMENT, CHARACTER = 100, 8
_IN_MEMORY = {_CELL: ELEMENT, _STRUCT: ELEMENT, _OBJECT: ELEMENT, _CHAR: CHARACTER}
# Bytes that are unpacked at a time; a name or a shape has fewer.
_CHUNK = 1 << 20
# Arrays within each other; a file of a rig has a few.
_DEPTH = 100


def count(path: Path) -> None:
    """Raise `LogError` if the elements of a file unpack to more than the limit, or declare more.

    Nothing of it is kept. A damaged element is left to the library, which says what is wrong.
    """
    unpacked = Unpacked()
    with path.open("rb") as file:
        order = "<" if file.read(_HEADER).endswith(b"IM") else ">"
        while len(tag := file.read(_TAG)) == _TAG:
            kind, size = struct.unpack(f"{order}II", tag)
            end = file.tell() + size
            if kind == _COMPRESSED:
                _count_compressed(file, size, order, unpacked)
            elif kind == _ARRAY:
                with suppress(EOFError, struct.error):
                    _count_array(_Stream(file), size, order, unpacked)
            file.seek(end)


class _Unzipped(io.RawIOBase):
    """What the next bytes of a file unpack to; they are counted as they are unpacked."""

    def __init__(self, file: BinaryIO, size: int, unpacked: Unpacked):
        self._file, self._left, self._unpacked = file, size, unpacked
        self._packer, self._packed = zlib.decompressobj(), b""

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: memoryview) -> int:  # type: ignore[override]
        ready = b""
        while not ready and (self._packed or self._left > 0):
            if not self._packed:
                self._packed = self._file.read(min(self._left, _CHUNK))
                self._left = self._left - len(self._packed) if self._packed else 0
            ready = self._packer.decompress(self._packed, len(buffer))
            self._packed = self._packer.unconsumed_tail
        self._unpacked.add(len(ready))
        buffer[: len(ready)] = ready
        return len(ready)


class _Stream:
    """Bytes in their order, and how many were taken."""

    def __init__(self, source: BinaryIO | io.BufferedReader):
        self._source, self.at = source, 0

    def read(self, size: int) -> bytes:
        if size > _CHUNK:
            raise ValueError("a name or a shape is too long")
        found = self._source.read(size)
        self.at += size
        if len(found) < size:
            raise EOFError
        return found

    def skip(self, size: int) -> None:
        self.at += size
        if self._source.seekable():
            self._source.seek(size, io.SEEK_CUR)
        while size > 0 and not self._source.seekable():
            found = len(self._source.read(min(size, _CHUNK)))
            size = size - found if found else 0


def _count_compressed(file: BinaryIO, size: int, order: str, unpacked: Unpacked) -> None:
    source = io.BufferedReader(_Unzipped(file, size, unpacked), _CHUNK)
    with suppress(zlib.error):
        stream = _Stream(source)
        with suppress(EOFError, struct.error):
            kind, size = struct.unpack(f"{order}II", stream.read(_TAG))
            if kind == _ARRAY:
                _count_array(stream, size, order, unpacked)
        while source.read(_CHUNK):
            pass


def _count_array(stream: _Stream, size: int, order: str, unpacked: Unpacked, depth: int = 0) -> None:
    """Count what an array of `size` bytes declares, and what the arrays in it declare."""
    end = stream.at + size
    kind = struct.unpack_from(f"{order}I", _data(stream, order))[0] & 0xFF
    shape = _data(stream, order)
    if kind in _IN_MEMORY:
        elements = math.prod(map(int, np.frombuffer(shape[: len(shape) // 4 * 4], f"{order}i4")))
        unpacked.add(max(elements, 0) * _IN_MEMORY[kind])
        _data(stream, order)  # its name
        if kind != _CHAR:
            _count_inner(stream, elements * _fields(stream, kind, order), order, unpacked, depth)
    stream.skip(end - stream.at)


def _fields(stream: _Stream, kind: int, order: str) -> int:
    """Arrays that each element of a cell or of a struct has."""
    if kind == _CELL:
        return 1
    if kind == _OBJECT:
        _data(stream, order)  # the name of its class
    length = struct.unpack_from(f"{order}i", _data(stream, order))[0]
    names = len(_data(stream, order))
    return names // length if length > 0 else 0


def _count_inner(stream: _Stream, arrays: int, order: str, unpacked: Unpacked, depth: int) -> None:
    if depth > _DEPTH:
        raise ValueError("too many structs in each other")
    for _ in range(arrays):
        kind, size = struct.unpack(f"{order}II", stream.read(_TAG))
        if kind != _ARRAY:
            return
        if size:
            _count_array(stream, size, order, unpacked, depth + 1)


def _data(stream: _Stream, order: str) -> bytes:
    """Data of the next element; up to four bytes stand in its tag."""
    tag = stream.read(_TAG)
    kind, size = struct.unpack(f"{order}II", tag)
    if small := kind >> 16:
        return tag[4 : 4 + small]
    found = stream.read(size)
    stream.skip(-size % 8)
    return found
