"""How pictures of maps look: inks, a palette that colour-blind people can tell apart, and text that is safe to draw."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cgdb.cli import render

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

PAPER = "#fcfbf8"
INK = "#23272e"
SOFT = "#6b7280"
FAINT = "#d8d5cd"
ROOM = "#f1efe9"
FITS = "#d1330b"
"""Results that fit, on pictures whose other things are dimmed to grey."""
NEAR = "#0a6fb3"
"""The nearest things, where nothing fits."""
ARROWS = ("#7b3294", "#008837", "#b8860b", "#0571b0", "#ca0020")

CLASSES = (
    "#4477AA", "#CC6677", "#DDCC77", "#117733", "#88CCEE", "#AA4499", "#44AA99", "#EE8866", "#999933", "#882255",
)  # fmt: skip
"""After Paul Tol's qualitative schemes: told apart with every common kind of colour blindness, on paper too."""
OTHER = "#b9b7b1"
"""Classes beyond the palette, and things that are called nothing."""
PLAIN = "#b4b1a8"
"""Points that the map gives no colour."""

FONTS = ("Inter", "Source Sans 3", "Noto Sans", "Helvetica Neue", "Segoe UI", "Arial", "Liberation Sans", "DejaVu Sans")
WIDE_FONTS = ("Noto Sans CJK JP", "Noto Sans CJK SC", "Hiragino Sans", "Microsoft YaHei", "Noto Sans Arabic")
"""Tried for the letters that the first font has not."""
MOST_LETTERS = 28
"""Of a name in a picture."""


def settings() -> dict[str, Any]:
    """What matplotlib is set to while a picture is drawn, whatever the person's own settings are.

    ``$`` in a stranger's caption is no mathematics, and files of the same map are the same bytes.
    """
    from matplotlib.font_manager import fontManager

    there = set(fontManager.get_font_names())
    fonts = [name for name in (*FONTS, *WIDE_FONTS) if name in there]
    return {
        "text.usetex": False,
        "text.parse_math": False,
        "font.family": fonts or ["sans-serif"],
        "font.size": 8.0,
        "text.color": INK,
        "axes.unicode_minus": False,
        "svg.hashsalt": "cgdb",
        "svg.fonttype": "path",
        "pdf.fonttype": 42,
        "path.simplify": True,
        "agg.path.chunksize": 0,
    }


def label(text: object, most: int = MOST_LETTERS) -> str:
    """A name as one short line: no control, direction or private characters, no runs of blanks."""
    # Cleaning a megabyte of caption for twenty letters would be a stranger's joke.
    clean = " ".join(render.clean(str(text)[: 8 * most]).split())
    return clean if len(clean) <= most else clean[: most - 1].rstrip() + "…"


def rgb(colors: Any) -> NDArray[np.uint8]:
    """(n, 3) uint8 of colours by name or hex."""
    import numpy as np
    from matplotlib.colors import to_rgb

    shares = np.array([to_rgb(color) for color in colors], np.float64).reshape(-1, 3)
    return np.asarray(np.round(shares * 255), np.uint8)


def blend(colors: NDArray[Any], towards: str, share: Any) -> NDArray[np.uint8]:
    """(n, 3) uint8 colours, moved towards another by a share of 0 to 1 each."""
    import numpy as np

    share = np.asarray(share, np.float32)[..., None]
    mixed = colors.astype(np.float32) * (1 - share) + rgb([towards]).astype(np.float32) * share
    return np.asarray(mixed, np.uint8)


def greyed(colors: NDArray[np.uint8], share: float) -> NDArray[np.uint8]:
    """(n, 3) uint8 colours with most of their colour taken, then moved towards the paper: what is not meant."""
    import numpy as np

    light = colors.astype(np.float32) @ np.asarray([0.299, 0.587, 0.114], np.float32)
    grey = (0.85 * light[:, None] + 0.15 * colors).astype(np.uint8)
    return blend(grey, PAPER, np.full(len(grey), share))
