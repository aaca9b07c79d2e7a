"""Pictures that come with a question: checked, made small, and brought to a vision model or a CLIP image tower."""

from __future__ import annotations

import base64
import io
from pathlib import Path

from cgdb.errors import CgdbError, UsageError
from cgdb.meaning.embed import Encoder, PictureEncoder

LARGEST_FILE = 30 << 20
LARGEST_SENT = 4 << 20
"""Bytes of a picture that is sent as it is, where nothing can make it smaller."""
LONGEST_SIDE = 1024
"""Pixels. Vision models look at no more, and charge by the pixel."""

_KINDS = (
    (b"\xff\xd8\xff", "image/jpeg"),
    (b"\x89PNG\r\n\x1a\n", "image/png"),
    (b"GIF8", "image/gif"),
    (b"RIFF", "image/webp"),
)


def checked(path: Path) -> tuple[bytes, str]:
    """The bytes of a picture file and its media type. UsageError where it is none."""
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise UsageError(f"{path} has more than {LARGEST_FILE >> 20} MB", hint="make the picture smaller")
        raw = path.read_bytes()
    except OSError as error:
        raise UsageError(f"{path} cannot be read: {error.strerror or error}") from None
    for beginning, kind in _KINDS:
        if raw.startswith(beginning) and (kind != "image/webp" or raw[8:12] == b"WEBP"):
            return raw, kind
    raise UsageError(f"{path} is no picture that is known here", hint="JPEG, PNG, WebP or GIF")


def data_url(path: Path) -> str:
    """A picture as vision models take it, scaled down where Pillow is at hand."""
    raw, kind = checked(path)
    try:
        from PIL import Image
    except ImportError:
        pass
    else:
        try:
            with Image.open(io.BytesIO(raw)) as picture:
                picture.thumbnail((LONGEST_SIDE, LONGEST_SIDE))
                out = io.BytesIO()
                picture.convert("RGB").save(out, "JPEG", quality=85)
        except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
            raise UsageError(f"{path} is a damaged picture: {str(error)[:100]}") from None
        raw, kind = out.getvalue(), "image/jpeg"
    if len(raw) > LARGEST_SENT:
        raise UsageError(
            f"{path} has {len(raw) >> 20} MB, too much to send", hint="pip install pillow, which makes it smaller"
        )
    return f"data:{kind};base64,{base64.b64encode(raw).decode('ascii')}"


def tower(found: Encoder | CgdbError | None) -> PictureEncoder | None:
    """An encoder of a feature space, where it takes pictures."""
    return found if isinstance(found, PictureEncoder) else None
