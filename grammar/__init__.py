"""CGQL: query text to tree and back. Modules in the order of the flow: cgql.lark, ast, parser, printer."""
