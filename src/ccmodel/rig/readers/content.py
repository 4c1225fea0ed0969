"""Content of a text log, unpacked if it is gzipped; and the limit on what any compressed file may unpack to."""

import gzip
import io
import zlib
from pathlib import Path

from ccmodel import inputs
from ccmodel.rig.findings import LogError


def content_of(path: Path) -> bytes:
    """Bytes of a file; of a gzipped one, of what is inside.

    Raises
    ------
    LogError
        If the gzip stream is cut or damaged, or unpacks to more than the limit (`ccmodel.inputs`).
    """
    raw = path.read_bytes()
    if raw[:2] != b"\x1f\x8b":
        return raw
    most = int(inputs.largest_bytes(inputs.UNPACKED))
    try:
        with gzip.open(io.BytesIO(raw)) as stream:
            unpacked = stream.read(most + 1)
    except EOFError:
        raise LogError(None, None, "the gzip stream is cut short: copy it again from the recorder") from None
    except (OSError, zlib.error):
        raise LogError(None, None, "the gzip stream is damaged: copy it again from the recorder") from None
    if len(unpacked) > most:
        raise LogError(None, None, f"unpacks to what is {inputs.too_large(inputs.UNPACKED)}")
    return unpacked


def check_unpacked(size: float) -> None:
    """Raise `LogError` if a file unpacks to more bytes than the limit (`ccmodel.inputs`)."""
    if size > inputs.largest_bytes(inputs.UNPACKED):
        found = f"unpacks to at least {size / 1e6:.4g} MB"
        raise LogError(None, None, f"{found}, which is {inputs.too_large(inputs.UNPACKED)}")


class Unpacked:
    """Counts what the parts of a file unpack to, each before it is read."""

    def __init__(self) -> None:
        self.size = 0

    def add(self, size: int) -> None:
        """Count `size` bytes more; raise `LogError` if that is above the limit."""
        self.size += size
        check_unpacked(self.size)
