"""Content of a text log, unpacked if it is gzipped; and the limit on what any compressed file may unpack to."""

import gzip
import io
import zlib
from dataclasses import dataclass
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
