"""What a caption says of a thing's colour, material or shape."""

from __future__ import annotations

import re

from cgdb.result import StoredNode

_WORDS = {
    "color": """white black gray grey brown red blue green yellow orange pink purple beige cream tan silver gold golden
        teal turquoise navy maroon violet ivory charcoal magenta cyan olive lilac lavender bronze copper colorful
        colourful multicolored multicoloured dark light pale""",
    "material": """wood wooden metal metallic steel iron aluminium aluminum brass plastic glass leather fabric cloth
        cotton wool velvet linen paper cardboard ceramic porcelain rubber stone marble granite concrete foam wax wicker
        rattan bamboo""",
    "shape": """round square rectangular circular oval cylindrical flat curved l-shaped u-shaped spherical triangular
        conical""",
}
_TRAITS = {what: frozenset(words.split()) for what, words in _WORDS.items()}
_ENDS = re.compile(
    r"\b(?:with|on|in|at|near|next|behind|under|above|against|beside|that|which|and (?:a|an|the)|of)\b|[,.;]"
)
_SHADES = frozenset(("dark", "light", "pale"))


def told(node: StoredNode, what: str) -> str:
    """The words for it ("dark brown"), from the part of the caption that names the thing itself; empty where none are.

    What stands behind "with" or "on" is said of something else.
    """
    known = _TRAITS.get(what, frozenset())
    for text in (node.caption or "", node.tag or ""):
        begins = _ENDS.split(text.casefold(), maxsplit=1)[0]
        found = [word for word in re.findall(r"[^\W_]+(?:-[^\W_]+)*", begins) if word in known]
        if found and not set(found) <= _SHADES:
            return " ".join(dict.fromkeys(found))
    return ""
