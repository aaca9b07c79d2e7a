"""cgql.lark -> tables.py: ``python -m cgdb.grammar.generate``.

Lark reads the grammar and works out the LALR(1) tables. They are kept in a module because that work, with the import of
Lark, takes 150 ms, which every shell call would pay. A test makes them again and compares.
"""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

STARTS = ("start", "script", "condition")
# What a name or a text stands for is told by the rule that would read it next.
ROLES = ("variable", "function", "alias", "label", "relation", "property", "scene", "meaning", "question", "moment")

HEADER = '''"""The LALR(1) tables of cgql.lark. Made by ``python -m cgdb.grammar.generate``; do not edit."""
# ruff: noqa: E501
# fmt: off

from __future__ import annotations
'''


def module(grammar: str) -> str:
    """The text of tables.py for a grammar."""
    from lark import Lark
    from lark.lexer import PatternStr
    from lark.parsers.lalr_analysis import LALR_Analyzer, Shift

    lark = Lark(grammar, parser="lalr", start=list(STARTS), keep_all_tokens=True)
    # debug: the states keep their items, which say what a name would stand for in each.
    analysis = LALR_Analyzer(lark.parser.parser_conf, debug=True)
    analysis.compute_lalr()  # type: ignore[no-untyped-call]
    table = analysis.parse_table

    shown: dict[str, str] = {"$END": "end"}
    patterns: dict[str, str] = {}
    for terminal in lark.terminals:
        if isinstance(terminal.pattern, PatternStr):
            shown[terminal.name] = terminal.pattern.value
        else:
            shown[terminal.name] = terminal.name
            patterns[terminal.name] = terminal.pattern.to_regexp()
    ignored = set(lark.ignore_tokens)
    terminals = sorted({s for t, s in shown.items() if t not in ignored})
    number = {name: terminals.index(text) for name, text in shown.items() if text in terminals}

    states = sorted(table.states, key=lambda s: sorted(map(repr, s)))
    order = {state: i for i, state in enumerate(states)}
    rules = sorted(
        {action[1] for row in table.states.values() for action in row.values() if action[0] is not Shift},
        key=lambda r: (r.origin.name, r.order, [s.name for s in r.expansion]),
    )
    rule_number = {rule: i for i, rule in enumerate(rules)}
    names = sorted({str(rule.origin.name) for rule in rules})

    rows, gotos, roles = [], [], []
    for state in states:
        row, goto = [], []
        for symbol, (kind, target) in sorted(table.states[state].items()):
            if kind is not Shift:
                row.append(f"{number[symbol]}:{-1 - rule_number[target]}")
            elif symbol in number:
                row.append(f"{number[symbol]}:{order[target]}")
            else:
                goto.append(f"{names.index(symbol)}:{order[target]}")
        predicted = {rule_pointer.rule.origin.name for rule_pointer in state if rule_pointer.index == 0}
        rows.append(" ".join(row))
        gotos.append(" ".join(goto))
        roles.append(" ".join(role for role in ROLES if role in predicted))

    def block(name: str, lines: list[str]) -> str:
        return f"\n{name} = (\n" + "".join(f"    {line!r},\n" for line in lines) + ")\n"

    listed = [
        HEADER,
        block("TERMINALS", terminals),
        "\nPATTERNS = {\n" + "".join(f"    {k!r}: {v!a},\n" for k, v in sorted(patterns.items())) + "}\n",
        block("NONTERMINALS", names),
        block(
            "RULES",
            [f"{names.index(r.origin.name)} {len(r.expansion)} {r.alias or ''}".strip() for r in rules],
        ),
        block("ACTIONS", rows),
        block("GOTOS", gotos),
        block("ROLES", roles),
        "\nSTARTS = {"
        + ", ".join(f'"{s}": ({order[table.start_states[s]]}, {order[table.end_states[s]]})' for s in STARTS)
        + "}\n",
    ]
    return "".join(listed)


def main() -> None:
    """Write tables.py beside this file."""
    grammar = files("cgdb.grammar").joinpath("cgql.lark").read_text(encoding="utf-8")
    Path(__file__).with_name("tables.py").write_text(module(grammar), encoding="utf-8")


if __name__ == "__main__":
    main()
