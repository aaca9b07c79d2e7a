"""Colours for dark and light terminals: of the pieces of a statement, and of what is shown."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Theme:
    """name: as in ``:theme``. syntax: {kind of piece: style}; ink: {part of the output: style}.

    A style is words that rich and prompt-toolkit both read: bold, italic, underline, #rrggbb.
    """

    name: str
    syntax: Mapping[str, str]
    ink: Mapping[str, str]


DARK = Theme(
    name="dark",
    syntax={
        "keyword": "bold #82aaff",
        "function": "#c792ea",
        "variable": "#eeffff",
        "alias": "italic #eeffff",
        "label": "#ffcb6b",
        "relation": "#89ddff",
        "property": "#b2ccd6",
        "text": "#c3e88d",
        "number": "#f78c6c",
        "unit": "#f78c6c",
        "parameter": "#ff9cac",
        "object": "#ffcb6b",
        "edge": "#89ddff",
        "operator": "#89ddff",
        "sign": "#8796b0",
        "comment": "italic #7c8aa5",
        "error": "underline #ff757f",
        "command": "bold #c792ea",
    },
    ink={
        "head": "bold #82aaff",
        "rule": "#4a5670",
        "faint": "#7c8aa5",
        "fits": "#a5d66a",
        "misses": "#7c8aa5",
        "bar": "#5f9f5f",
        "number": "#f7b48c",
        "id": "#ffcb6b",
        "error": "bold #ff757f",
        "hint": "#89ddff",
        "prompt": "bold #82aaff",
        "mark": "bold #1d2433 on #a5d66a",
        "near": "bold #1d2433 on #ffcb6b",
        "room": "#6f83a8",
        "thing": "#5b6880",
    },
)

LIGHT = Theme(
    name="light",
    syntax={
        "keyword": "bold #0550ae",
        "function": "#8250df",
        "variable": "#1f2328",
        "alias": "italic #1f2328",
        "label": "#953800",
        "relation": "#0a6c74",
        "property": "#3b4a5a",
        "text": "#116329",
        "number": "#a04100",
        "unit": "#a04100",
        "parameter": "#b0205a",
        "object": "#953800",
        "edge": "#0a6c74",
        "operator": "#0a6c74",
        "sign": "#59636e",
        "comment": "italic #6e7781",
        "error": "underline #cf222e",
        "command": "bold #8250df",
    },
    ink={
        "head": "bold #0550ae",
        "rule": "#c0c7cf",
        "faint": "#6e7781",
        "fits": "#1a7f37",
        "misses": "#6e7781",
        "bar": "#4d9a5f",
        "number": "#a04100",
        "id": "#953800",
        "error": "bold #cf222e",
        "hint": "#0a6c74",
        "prompt": "bold #0550ae",
        "mark": "bold #ffffff on #1a7f37",
        "near": "bold #ffffff on #b35900",
        "room": "#7d8896",
        "thing": "#a0a9b4",
    },
)

PLAIN = Theme(name="plain", syntax={}, ink={})
"""Without colours: for monochrome terminals, and for output that goes elsewhere."""

THEMES: Mapping[str, Theme] = {theme.name: theme for theme in (DARK, LIGHT, PLAIN)}


def suited() -> Theme:
    """The theme for this terminal, as far as it says: NO_COLOR, and COLORFGBG's background where it is set."""
    if os.environ.get("NO_COLOR") or os.environ.get("TERM") == "dumb":
        return PLAIN
    background = os.environ.get("COLORFGBG", "").rpartition(";")[2]
    return LIGHT if background in ("7", "15") else DARK
