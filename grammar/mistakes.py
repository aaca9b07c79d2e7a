"""Why a text is not CGQL, in people's words: what was found, what could stand there, and the slip that explains it.

Only asked after the parser has refused a text: it reads the text again, slowly, up to the same place. What is a slip
stands as a list of small functions, each of which knows one and is asked in turn.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from cgdb.errors import ParseError, Span, did_you_mean
from cgdb.grammar.ast import UNITS
from cgdb.grammar.machine import KEYWORDS, RESERVED, Token, Walk
from cgdb.grammar.tables import TERMINALS

CLAUSES = ("EXPLAIN", "PROFILE", "USE", "AS", "MATCH", "WHERE", "RETURN", "ORDER", "RERANK", "SKIP", "LIMIT")
"""The words that begin a clause, in the order that they stand in."""
COMPARISONS = frozenset({"=", "<>", "<", "<=", ">", ">=", "IN", "CONTAINS", "STARTS", "IS"})
EDGES = frozenset({"EDGE", "EDGE_IN", "-->", "<--", "--"})


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """Where a text stopped being CGQL: the token, the tokens before it, and what would have fitted."""

    text: str
    token: Token
    after: str
    """The character that follows the token without a space, or ""."""
    before: tuple[Token, ...]
    read: tuple[str, ...]
    """The terminals that the tokens before were read as."""
    fits: frozenset[str]
    roles: frozenset[str]
    """What a name would have stood for."""

    @property
    def span(self) -> Span:
        return Span(self.token.start, self.token.end)

    @property
    def word(self) -> str:
        return self.token.text.upper() if self.token.group == "NAME" else ""

    def last(self, back: int = 1) -> str:
        """The terminal read that many tokens ago, or ""."""
        return self.read[-back] if len(self.read) >= back else ""


Slip = tuple[str, str | None]
"""A message and a hint."""


def mistake(text: str, root: str) -> ParseError:
    """The error of a text that the grammar refuses; root is the rule that it was read as."""
    place = _place(text, root)
    for slip in SLIPS:
        found = slip(place)
        if found is not None:
            return ParseError(found[0], hint=found[1], span=place.span, source=text)
    unclosed = _unclosed(place)
    if unclosed is not None:
        return unclosed
    expected = _expected(place)
    message = (
        f"found {_shown(place.token)} where {expected} is expected" if expected else f"found {_shown(place.token)}"
    )
    return ParseError(message, hint=_nearest(place), span=place.span, source=text)


def _place(text: str, root: str) -> Place:
    walk = Walk(root)
    before: list[Token] = []
    read: list[str] = []
    for token in walk.machine.scan(text):
        terminal = walk.machine.terminal(walk.state, token.group, token.text)
        if terminal == walk.machine.end or walk.step(terminal) is None:
            fitting = walk.acceptable()
            shifting = {walk.machine.name, TERMINALS.index("TEXT")}
            roles = [walk.machine.roles[state] for t, state in fitting.items() if t in shifting]
            return Place(
                text=text,
                token=token,
                after=text[token.end : token.end + 1],
                before=tuple(before),
                read=tuple(read),
                fits=frozenset(TERMINALS[t] for t in fitting),
                roles=frozenset().union(*roles),
            )
        before.append(token)
        read.append(TERMINALS[terminal])
    raise AssertionError("the scanner ends with the end")


# -- slips ------------------------------------------------------------------------------------------------------

_STRAIGHT = dict.fromkeys("“”„‟«»", '"') | dict.fromkeys("‘’‚‛´", "'")
_LOOKALIKES = {
    "–": "-",
    "—": "-",
    "−": "-",
    "→": "->",
    "←": "<-",
    "×": "*",
    "÷": "/",
    "≤": "<=",
    "≥": ">=",
    "≠": "<>",
    "≈": "~",
    "∼": "~",
    "∧": "AND",
    "∨": "OR",
    "¬": "NOT",
    "，": ",",
    "（": "(",
    "）": ")",
    "：": ":",
    "；": ";",
    "…": "..",
}
_SIGNS = {
    "!": "NOT is written out, and 'not equal' is <>",
    "&": "AND is written out",
    "^": "there is no power: write a * a",
    "?": "a parameter is written $name",
    "@": "a parameter is written $name",
    "$": "a parameter is a $ and a name: $picture",
    "\\": None,
}


def _strange_character(place: Place) -> Slip | None:
    if place.token.group != "unknown":
        return None
    character = place.token.text
    if character in _STRAIGHT:
        return f"found the curly quote {character}", f"write it straight: {_STRAIGHT[character]}"
    if character in _LOOKALIKES:
        return f"found the character {character}", f"write {_LOOKALIKES[character]}"
    if character == "!" and place.after == "=":
        return "found '!='", "'not equal' is written <>"
    if character in _SIGNS:
        return f"found '{character}', which means nothing here", _SIGNS[character]
    if character.isprintable():
        return (
            f"found the character {character} (U+{ord(character):04X})",
            "texts stand in quotes, unusual names in `backticks`",
        )
    return f"found the invisible character U+{ord(character):04X}", "take it out, or write a space"


def _open_quote(place: Place) -> Slip | None:
    if place.token.group != "open":
        return None
    quote, inner = place.token.text[0], place.token.text[1:]
    what = "name" if quote == "`" else "text"
    if inner.startswith(quote):
        return "found a name without letters", "write the name between the backticks"
    wrong = re.search(r"\\(?![\\'\"`nrt]|u[0-9a-fA-F]{4})", inner)
    closing = re.search(rf"(?<!\\){quote}", inner)
    if wrong and (closing is None or wrong.start() < closing.start()):
        return f"this {what} has the unknown escape {inner[wrong.start() : wrong.start() + 2]}", (
            "the escapes are \\n \\t \\r \\\\ \\' \\\" \\` and \\u with four digits; a lone backslash is written \\\\"
        )
    control = re.search(r"[\x00-\x1f]", inner)
    if control and (closing is None or control.start() < closing.start()):
        return f"this {what} holds the character U+{ord(control[0]):04X}", f"write it as \\u{ord(control[0]):04x}"
    if closing:
        most = "256 characters" if quote == "`" else "4,096 characters"
        return f"this {what} is longer than {most}", "give long texts as parameters ($name)"
    if quote == "'" and any(t.group == "TEXT" and t.text[0] == "'" for t in place.before):
        return "this text has no closing quote", _APOSTROPHE
    return f"this {what} has no closing quote", f"add {quote} at its end; a text stands on one line"


_APOSTROPHE = "an apostrophe inside a text is written \\', or put the text in double quotes"


def _apostrophe(place: Place) -> Slip | None:
    previous = place.before[-1] if place.before else None
    if previous is None or previous.group != "TEXT" or previous.text[0] != "'" or previous.end != place.token.start:
        return None
    if place.token.group not in ("NAME", "INTEGER"):
        return None
    return f"found {_shown(place.token)} after a text", _APOSTROPHE


def _words_of_a_name(place: Place) -> Slip | None:
    if place.token.group != "NAME" or place.last() != "NAME" or place.last(2) not in (":", "|", "."):
        return None
    if place.word in CLAUSES or place.word in ("AND", "OR") or _nearest_keyword(place):
        return None
    words = f"{place.before[-1].text} {place.token.text}"
    return f"found {_shown(place.token)} after a name", f"names of several words stand in backticks: `{words} ...`"


def _bare_node(place: Place) -> Slip | None:
    if place.token.group == "NAME" and place.fits == {"("} and place.word not in KEYWORDS:
        return (
            f"found {_shown(place.token)} where a node is expected",
            f"nodes stand in parentheses: ({place.token.text})",
        )
    return None


def _half_keyword(place: Place) -> Slip | None:
    halves = {"ORDER": "BY", "RERANK": "BY", "STARTS": "WITH"}
    second = halves.get(place.last())
    if second is None or place.fits != {second}:
        return None
    return f"found {_shown(place.token)} where {second} is expected", f"it is written {place.last()} {second}"


def _property_in_pattern(place: Place) -> Slip | None:
    if place.token.text == "." and place.last() == "NAME" and place.last(2) == "(" and "{" in place.fits:
        return "found '.' in a node", "a node is (o) or (o {name: 'x'}); other conditions on o.name stand in WHERE"
    return None


def _property_sign(place: Place) -> Slip | None:
    if place.token.text == "=" and place.fits == {":"}:
        return "found '=' in the properties of a node", "they are written {name: 'x'}; other comparisons stand in WHERE"
    return None


def _nothing_there(place: Place) -> Slip | None:
    if place.token.group != "end" or any(t.text != ";" for t in place.before) or "MATCH" not in place.fits:
        return None
    return "there is no statement", 'such as: MATCH (o ~ "cup") RETURN o'


def _long_pieces(place: Place) -> Slip | None:
    previous = place.before[-1] if place.before else None
    if previous is None or previous.end != place.token.start:
        return None
    if place.token.group == previous.group == "NAME" and len(previous.text) == 128:
        return "a name has at most 128 characters", "put longer ones in `backticks`"
    if place.token.group in ("INTEGER", "DECIMAL") and previous.group in ("INTEGER", "DECIMAL"):
        return "this number has too many digits", "whole numbers have at most 19 digits, others 30 after the point"
    return None


_WRITES = frozenset(
    ("CREATE", "INSERT", "MERGE", "SET", "DELETE", "DETACH", "REMOVE", "UPDATE", "DROP", "ALTER", "LOAD", "COPY")
)
_ELSEWHERE = {
    "SELECT": 'begin with a pattern and end with what is wanted: MATCH (o ~ "cup") RETURN o',
    "FROM": "say which scenes at the beginning: USE 'lab' MATCH ...",
    "JOIN": "write the relation as an edge: (a)-[:on]->(b)",
    "OPTIONAL": "every pattern of MATCH must be there; ask for the rest in a second statement",
    "UNWIND": "ask with a list instead: WHERE o.id IN $ids",
    "CALL": "functions stand in conditions and in RETURN",
    "YIELD": "functions stand in conditions and in RETURN",
    "UNION": "ask twice, or join conditions with OR",
    "GROUP": "rows are grouped by what RETURN names beside count, min, max, avg, sum and collect",
    "HAVING": "RETURN the count and look at it there; a statement has no second WHERE",
    "ENDS": "there are CONTAINS, STARTS WITH and ~ (meaning)",
    "LIKE": "there are CONTAINS, STARTS WITH and ~ (meaning)",
    "ILIKE": "there are CONTAINS, STARTS WITH and ~ (meaning); all ignore case",
    "MATCHES": "there are CONTAINS, STARTS WITH and ~ (meaning)",
    "SIMILAR": "matching by meaning is written o ~ 'text'",
    "BETWEEN": "write two comparisons: a <= x AND x <= b",
    "XOR": "write (a OR b) AND NOT (a AND b)",
    "CASE": "there is no CASE; RETURN the condition itself",
    "OFFSET": "the first rows are left out with SKIP",
    "FETCH": "the number of rows is given with LIMIT",
    "ASCENDING": "write ASC",
    "DESCENDING": "write DESC",
    "FIND": 'begin with a pattern: MATCH (o ~ "cup") RETURN o',
    "GET": 'begin with a pattern: MATCH (o ~ "cup") RETURN o',
    "SHOW": 'begin with a pattern: MATCH (o ~ "cup") RETURN o',
}


def _other_language(place: Place) -> Slip | None:
    word = place.word
    if word in _WRITES:
        return f"CGQL only reads: there is no {word}", "maps are changed from Python or the command line"
    if word == "WITH" and place.last() != "STARTS":
        return "there is no WITH: a statement is one MATCH and one RETURN", "name a result with AS in RETURN"
    if word in _ELSEWHERE:
        return f"there is no {word} in CGQL", _ELSEWHERE[word]
    return None


def _doubled_sign(place: Place) -> Slip | None:
    sign, previous = place.token.text, place.before[-1] if place.before else None
    if place.token.group != "SIGN" or previous is None or previous.end != place.token.start:
        return None
    both = previous.text + sign
    hints = {
        "==": "'equal' is written =",
        "=~": "there are no regular expressions: use CONTAINS, STARTS WITH or ~ (meaning)",
        "=<": "'at most' is written <=",
        "=>": "'at least' is written >=, and an edge -[:on]->",
        "><": "'not equal' is written <>",
        "||": "OR is written out",
        "**": "there is no power: write a * a",
        "~=": "meaning is written ~, and equality =",
        "~~": "meaning is written with one ~",
        "->": "an edge is written -[:on]-> or -->",
        "|:": "the colon stands once: -[:on|in]->",
        "::": "one colon is enough",
    }
    if both == "|:":
        return "found a colon after |", hints[both]
    return (f"found '{both}'", hints[both]) if both in hints else None


def _arrow(place: Place) -> Slip | None:
    sign, last = place.token.text, place.last()
    way = "an edge is written -[:on]->, <-[:on]- or -[:on]-, and without a relation -->, <-- or --"
    if last == "]" and "->" in place.fits:
        return f"found {_shown(place.token)} where the edge should end", "an edge ends with ]-> or ]-"
    if sign == "->" and last == "]":
        return "this edge points both ways", "write -[...]- for an edge either way"
    if place.fits & EDGES and last == ")" and sign in ("->", "<-", "-", "<", ">", "=", "["):
        return f"found '{sign}' after a node", way
    if (last == "-" and sign == ">") or (
        place.fits & {"("} and last in ("->", "-", *EDGES) and sign in (">", "-", "[")
    ):
        return f"found '{sign}'", way
    if sign == "->" and place.fits & {"AND", "RETURN"}:
        return "found '->'", way
    return None


def _unknown_unit(place: Place) -> Slip | None:
    if not place.word or place.word in KEYWORDS or "UNIT" not in place.fits:
        return None
    if _nearest_keyword(place) and place.before[-1].end != place.token.start:
        return None
    known = {"METRE": "m", "METER": "m", "CENTIMETRE": "cm", "CENTIMETER": "cm", "MILLIMETRE": "mm", "MILLIMETER": "mm"}
    known |= {"KILOMETRE": "km", "KILOMETER": "km", "INCH": "in", "INCHE": "in", "FOOT": "ft", "FEET": "ft"}
    known |= {"DECIMETRE": "dm", "DECIMETER": "dm"}
    unit = known.get(place.word) or known.get(place.word.removesuffix("S"))
    hint = f"write {place.before[-1].text}in, without a space" if unit == "in" else f"write {unit}"
    units = ", ".join(unit for unit in UNITS)
    return f"'{place.token.text}' is no unit", hint if unit else f"the units are {units}"


def _spaced_inches(place: Place) -> Slip | None:
    if place.word == "IN" and place.last() in ("INTEGER", "DECIMAL"):
        return "found IN after a comparison", f"inches touch their number: {place.before[-1].text}in"
    for back in (1, 2, 3):
        if place.last(back) == "IN" and place.last(back + 1) in ("INTEGER", "DECIMAL"):
            number = place.before[-back - 1].text
            return f"found {_shown(place.token)} after IN", f"inches touch their number: {number}in"
    return None


def _star_returned(place: Place) -> Slip | None:
    if place.token.text == "*" and place.last() in ("RETURN", "DISTINCT"):
        return "there is no RETURN *", "name what is wanted, such as RETURN o"
    return None


def _clause_order(place: Place) -> Slip | None:
    word = place.word
    if word not in CLAUSES or word in place.fits or "variable" in place.roles or place.token.group == "end":
        return None
    seen = [t for t in place.read[_statement(place) :] if t in CLAUSES]
    if word == "AS" or not seen:
        return None
    if word in seen and word in ("EXPLAIN", "PROFILE", "USE", "RERANK", "SKIP", "LIMIT", "RETURN", "ORDER"):
        return f"there is a second {_clause(word)}", "one is enough; lists are separated by commas"
    if word in seen:
        hint = "separate patterns by commas: MATCH (a), (b)" if word == "MATCH" else "join conditions with AND"
        return f"there is a second {word}", hint
    later = [t for t in seen if CLAUSES.index(t) > CLAUSES.index(word)]
    if later:
        return f"{_clause(word)} stands before {_clause(later[0])}", (
            "the order is USE, AS OF, MATCH, WHERE, RETURN, ORDER BY, RERANK BY, SKIP, LIMIT"
        )
    return None


def _statement(place: Place) -> int:
    """Where the tokens of the statement begin in which the place lies."""
    return max((i + 1 for i, terminal in enumerate(place.read) if terminal == ";"), default=0)


def _clause(word: str) -> str:
    return {"ORDER": "ORDER BY", "RERANK": "RERANK BY", "AS": "AS OF"}.get(word, word)


def _keyword_as_name(place: Place) -> Slip | None:
    if place.word not in RESERVED or "NAME" not in place.fits or place.word in place.fits:
        return None
    # In capitals it was meant as the keyword, and what should stand before it is missing.
    hint = None if place.token.text.isupper() else f"if it is a name, put it in backticks: `{place.token.text}`"
    return f"found the keyword {place.word} where {_expected(place)} is expected", hint


def _second_comparison(place: Place) -> Slip | None:
    terminal = place.word or place.token.text
    if terminal not in COMPARISONS or "AND" not in place.fits:
        return None
    return f"found a second {_shown(place.token)} in one comparison", "write two comparisons: a < b AND b < c"


def _similar_side(place: Place) -> Slip | None:
    if place.token.text != "~":
        return None
    if "AND" in place.fits or "RETURN" in place.fits:
        return "~ stands after the name of an object", "such as o ~ 'cup', which looks at all that is known of o"
    return None


def _unquoted(place: Place) -> Slip | None:
    if place.token.group != "NAME" or "TEXT" not in place.fits or "NAME" in place.fits:
        return None
    if place.last() == "#":
        return f"found {_shown(place.token)} after #", f'ids that are texts stand in quotes: #"{place.token.text}"'
    return (
        f"found {_shown(place.token)} where {_expected(place)} is expected",
        f"put texts in quotes: '{place.token.text}'",
    )


def _missing_edge(place: Place) -> Slip | None:
    if place.last() == ")" and place.fits <= EDGES:
        return (
            "a pattern is a condition only with an edge",
            "such as (o)-[:in]->(:Room); conditions on o alone: o ~ 'cup', o.name = 'x'",
        )
    return None


def _missing_return(place: Place) -> Slip | None:
    if place.token.group == "end" or place.token.text == ";" or place.word in ("ORDER", "RERANK", "SKIP", "LIMIT"):
        if "RETURN" not in place.fits:
            return None
        named = next(
            (
                b.text
                for a, b in zip(place.before, place.before[1:], strict=False)
                if a.text == "(" and b.group == "NAME"
            ),
            "o",
        )
        return "the statement has no RETURN", f"say what is wanted: RETURN {named}"
    return None


def _two_statements(place: Place) -> Slip | None:
    if place.last() == ";" and place.fits <= {"end"}:
        return "this is a second statement", "give one statement at a time, or run the text as a script"
    return None


SLIPS: tuple[Callable[[Place], Slip | None], ...] = (
    _strange_character,
    _open_quote,
    _nothing_there,
    _two_statements,
    _long_pieces,
    _apostrophe,
    _other_language,
    _doubled_sign,
    _star_returned,
    _spaced_inches,
    _missing_edge,
    _arrow,
    _clause_order,
    _keyword_as_name,
    _similar_side,
    _second_comparison,
    _half_keyword,
    _property_in_pattern,
    _property_sign,
    _bare_node,
    _words_of_a_name,
    _unknown_unit,
    _unquoted,
    _missing_return,
)


def _unclosed(place: Place) -> ParseError | None:
    """A bracket without its partner, where that is why the place does not fit."""
    pairs = {")": "(", "]": "[", "}": "{"}
    stack: list[Token] = []
    for token in place.before:
        if token.text[-1] in "([{" and token.group in ("SIGN", "EDGE", "EDGE_IN"):
            stack.append(token)
        elif token.text in pairs and stack:
            stack.pop()
    if place.token.text in pairs and not stack:
        return ParseError(f"this {place.token.text} closes nothing", span=place.span, source=place.text)
    breaking = place.token.group == "end" or place.word in CLAUSES or place.token.text in (";", "->", "-", *pairs)
    if not stack or not breaking:
        return None
    opening = stack[-1]
    wanted = next(closing for closing, sign in pairs.items() if sign == opening.text[-1])
    if wanted not in place.fits:
        return None
    span = Span(opening.start, opening.end)
    return ParseError(f"this {opening.text} is never closed", hint=f"add {wanted}", span=span, source=place.text)


# -- words for what was found and what was expected -----------------------------------------------------------------


def _shown(token: Token) -> str:
    if token.group == "end":
        return "the end of the text"
    if token.group in ("TEXT", "open"):
        return "a text" if len(token.text) > 40 else f"the text {token.text}"
    if token.group == "NAME" and token.text in KEYWORDS:
        return token.text
    return f"'{token.text[:40]}'"


_ROLES = {
    "variable": "a variable",
    "function": "a function",
    "alias": "a name",
    "label": "a label",
    "relation": "a relation",
    "property": "the name of a property",
}
_VALUE = frozenset({"TRUE", "NULL", "TEXT", "NAME", "[", "INTEGER"})


def _expected(place: Place) -> str:
    """What could stand at the place, the likeliest first: "RETURN, a comparison or AND"."""
    fits, listed = set(place.fits), []
    if fits >= _VALUE:
        listed.append("a condition" if place.last() in ("", "WHERE", "AND", "OR", "NOT") else "a value")
        fits -= _VALUE | {"FALSE", "NOT", "PARAMETER", "QUOTED", "DECIMAL", "INCHES", "#", "(", "-"}
    if "NAME" in fits:
        roles = [words for role, words in _ROLES.items() if role in place.roles]
        listed.extend(roles[:1] or ["a name"])
    if "TEXT" in fits:
        listed.append("the name of a scene in quotes" if "scene" in place.roles else "a text in quotes")
    if fits & {"INTEGER", "DECIMAL"}:
        listed.append("a number" if "DECIMAL" in fits else "a whole number")
    if "PARAMETER" in fits:
        listed.append("a parameter ($name)")
    if "#" in fits:
        listed.append("an object (#12)")
    if len(fits & EDGES) > 1:
        listed.append("an edge")
    closing = [sign for sign in (")", "]", "}", ",") if sign in fits]
    words = sorted((w for w in fits & KEYWORDS - COMPARISONS), key=_importance)
    listed.extend(_clause(word) if word != "AS" or "MATCH" in place.fits else word for word in words)
    if len(fits & COMPARISONS) > 1:
        listed.append("a comparison")
    signs = fits - KEYWORDS - EDGES - COMPARISONS - {"NAME", "TEXT", "INTEGER", "DECIMAL", "PARAMETER", "#", "QUOTED"}
    signs -= {"INCHES", "UNIT", "+", "-", "*", "/", "%", *closing} if "AND" in fits else {"QUOTED", *closing}
    listed.extend(f"'{sign}'" for sign in [*closing, *sorted(signs)] if sign != "end")
    return _either(listed[:6])


def _importance(word: str) -> tuple[int, str]:
    order = ("MATCH", "WHERE", "RETURN", "AND", "OR", "ORDER", "LIMIT", "AS")
    return (order.index(word) if word in order else len(order), word)


def _either(listed: Iterable[str]) -> str:
    *others, last = list(listed) or [""]
    return f"{', '.join(others)} or {last}" if others else last


def _nearest_keyword(place: Place) -> str | None:
    if len(place.word) < 3 or place.word in KEYWORDS:
        return None
    return did_you_mean(place.word, sorted(place.fits & KEYWORDS))


def _nearest(place: Place) -> str | None:
    return _nearest_keyword(place)
