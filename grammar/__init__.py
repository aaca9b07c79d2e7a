"""CGQL: query text to tree and back. In the order of the flow: cgql.lark, ast, machine, build, parser, printer.

Beside the flow: tables (made of cgql.lark by generate), limits, mistakes (messages), completion, highlight.
"""
