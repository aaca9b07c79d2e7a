"""A scene graph to files and texts: formats (the registry, and the way in) -> one module per format -> whole_file."""

from __future__ import annotations

from cgdb.export.documents import Document
from cgdb.export.formats import EXPORTERS, SUFFIXES, WITH_VIEWS, Exported, document, dumps, export, format_of
from cgdb.export.networkx_graph import to_networkx
from cgdb.export.whole_file import write_whole

__all__ = [
    "EXPORTERS",
    "SUFFIXES",
    "WITH_VIEWS",
    "Document",
    "Exported",
    "document",
    "dumps",
    "export",
    "format_of",
    "to_networkx",
    "write_whole",
]
