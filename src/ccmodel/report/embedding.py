"""What makes the page one file: figures, styles and scripts inside it, and nothing in it that ends a script early."""

import base64
import io
import json
import re
import zlib
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path

from PIL import Image

MEDIA_TYPES = {".png": "image/png", ".svg": "image/svg+xml"}
_SOURCE = re.compile(r'(<img\b[^>]*?)\bsrc="(?!data:)([^"]+)"')


def with_figures(html: str, folder: Path) -> str:
    """HTML with the files of its images inside it; the path of each stays as ``data-file``.

    Parameters
    ----------
    html : str
    folder : Path
        Folder that the paths are relative to.
    """

    def embedded(match: re.Match) -> str:
        file = folder / match[2]
        data = base64.b64encode(_small(file)).decode()
        return f'{match[1]}data-file="{match[2]}" src="data:{MEDIA_TYPES[file.suffix]};base64,{data}"'

    return _SOURCE.sub(embedded, html)


def _small(file: Path) -> bytes:
    """Content of an image; of a PNG with 256 colours, a third of its size and the same to the eye."""
    if file.suffix != ".png":
        return file.read_bytes()
    buffer = io.BytesIO()
    with Image.open(file) as image:
        image.convert("RGB").quantize(256, dither=Image.Dither.NONE).save(buffer, "PNG", optimize=True)
    return min(file.read_bytes(), buffer.getvalue(), key=len)


def as_json(data: Mapping | Sequence) -> str:
    """Data as JSON inside a script element, which no text in the data can close."""
    text = json.dumps(data, ensure_ascii=False, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c")


def compressed(data: bytes) -> str:
    """Bytes as the text of a script element: zlib, then base64; `inflated` in viewer.js reads it."""
    return base64.b64encode(zlib.compress(data, 9)).decode()


@cache
def asset(name: str) -> str:
    """Text of a style or script of the package, by its path in ``ccmodel``."""
    return (Path(__file__).parents[1] / name).read_text(encoding="utf-8")
