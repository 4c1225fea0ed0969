"""Content of a text log, unpacked if it is gzipped; and the limit on what any compressed file may unpack to."""

import gzip
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from io import BufferedReader
from pathlib import Path

from ccmodel import inputs
from ccmodel.rig.findings import LogError

# Of a block of what is read as a whole.
BLOCK_BYTES = 1_000_000


def blocks_of(path: Path, size: int) -> Iterator[bytes]:
    """Content of a text file in blocks of whole lines, of a gzipped one what is inside; each of about `size` bytes.

    Raises
    ------
    LogError
        If the gzip stream is cut or damaged, or unpacks to more than the limit (`ccmodel.inputs`).
    """
    unpacked, rest = Unpacked(), b""
    with open(path, "rb") as file:
        is_gzipped = file.read(2) == b"\x1f\x8b"
        file.seek(0)
        stream: gzip.GzipFile | BufferedReader = gzip.GzipFile(fileobj=file) if is_gzipped else file
        while block := _read(stream, size):
            if is_gzipped:
                unpacked.add(len(block))
            whole, end, rest_of_block = block.rpartition(b"\n")
            if end:
                yield rest + whole + end
                rest = rest_of_block
            else:
                rest += block
    if rest:
        yield rest


def _read(stream: gzip.GzipFile | BufferedReader, size: int) -> bytes:
    try:
        return stream.read(size)
    except EOFError:
        raise LogError(None, None, "the gzip stream is cut short: copy it again from the recorder") from None
    except (gzip.BadGzipFile, zlib.error):
        raise LogError(None, None, "the gzip stream is damaged: copy it again from the recorder") from None


def content_of(path: Path) -> bytes:
    """Bytes of a file, of a gzipped one of what is inside; raises as `blocks_of`."""
    return b"".join(blocks_of(path, BLOCK_BYTES))


@dataclass
class Unpacked:
    """Bytes that a file has unpacked to so far; they are added before the memory is taken."""

    size: int = 0

    def add(self, size: int) -> None:
        """Count further bytes; raise `LogError` if they are above the limit (`ccmodel.inputs`)."""
        self.size += size
        if self.size > inputs.largest_bytes(inputs.UNPACKED):
            found = f"{self.size / 1e6:.0f} MB or more, which is {inputs.too_large(inputs.UNPACKED)}"
            raise LogError(None, None, f"unpacks to {found}")
