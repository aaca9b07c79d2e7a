"""Whether a question is English, by its small words: what is in another language is only matched by meaning."""

from __future__ import annotations

import unicodedata
from collections.abc import Mapping, Sequence

from cgdb.meaning.lexicon import FUNCTION_WORDS, RELATION_WORDS

_SMALL_WORDS: Mapping[str, str] = {
    "German": """der die das den dem ein eine einen einem einer und oder nicht kein keine ist sind wo was wie womit
        ich mit auf unter neben zum zur für von im etwas gibt es kann man außer viele bitte zeige mir""",
    "French": """le la les un une des du et ou où est sont pas ne que qui quoi je sur sous dans pour avec sans près
        côté quelque chose combien y il elle peut autre montre moi à au aux""",
    "Spanish": """el la los las un una unos unas y o no es son está están dónde donde qué que yo en sobre bajo con sin
        para algo cuántos cuántas hay puedo de del al cerca otro muéstrame""",
    "Italian": """il lo la gli le un una uno e o non è sono dove che cosa io su sotto con senza per qualcosa quanti
        quante ci c'è posso di del della nel nella vicino altro mostrami""",
    "Portuguese": """o a os as um uma e ou não é são onde que eu em no na sobre sob com sem para algo quantos quantas
        há posso de do da perto outro mostre""",
    "Dutch": """de het een en of niet geen is zijn waar wat ik op onder naast met zonder voor van in iets hoeveel er
        kan men bij anders""",
}
_WORDS = {name: frozenset(text.split()) for name, text in _SMALL_WORDS.items()}
_ENGLISH = FUNCTION_WORDS | RELATION_WORDS | frozenset(("find", "show", "something", "somewhere", "many", "there"))


def other_language(text: str, forms: Sequence[str]) -> str | None:
    """The language of a question that is not English, or "another script"; None where it may be English.

    A name in a foreign tongue ("chaise longue") is no foreign sentence: two small words and most of them are asked.
    """
    letters = [c for c in text if c.isalpha()]
    latin = sum(1 for c in letters if "LATIN" in unicodedata.name(c, ""))
    if letters and latin < len(letters) / 2:
        return "another script"
    english = sum(form in _ENGLISH for form in forms)
    name, most = None, 0
    for language, small in _WORDS.items():
        count = sum(form in small for form in forms)
        if count > most:
            name, most = language, count
    return name if most >= 2 and most > english else None
