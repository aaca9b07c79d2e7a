"""``cgdb prune``: the old history of a store goes."""

from __future__ import annotations

import json
from argparse import Namespace
from typing import TYPE_CHECKING

import cgdb
from cgdb.cli import render
from cgdb.cli.asking import warn
from cgdb.errors import UsageError

if TYPE_CHECKING:
    from cgdb.storage.prune import Pruned

MOST = 8
"""Scenes that are told of one by one."""


def prune(options: Namespace) -> int:
    """Prune a store, or say what would go."""
    if options.keep is None and options.before is None:
        raise UsageError("prune must be told what stays", hint="--keep N revisions, or those since --before REVISION")
    if options.keep is not None and options.keep < 1:
        raise UsageError(f"--keep {options.keep}: the last revision of a scene always stays", hint="--keep 1 or more")
    with cgdb.open(options.store, text_encoder=None) as db:
        pruned = db.prune(keep=options.keep, before=options.before, scenes=options.scene or (), dry_run=options.dry_run)
    if options.json:
        render.write(json.dumps(_record(pruned), ensure_ascii=False, indent=2))
    else:
        for line in _told(pruned):
            render.say(line)
    warn(pruned.notes)
    return 0


def kept_since(db: cgdb.Database) -> tuple[str, ...]:
    """A line for each scene whose older history was pruned; many scenes in one."""
    horizons = db.horizons()
    lines = [
        f"history before revision {one.kept_from} of scene '{name}' was pruned ({_count(one.revisions, 'revision')})"
        for name, one in horizons.items()
    ]
    if len(lines) <= MOST:
        return tuple(lines)
    rest = [one.revisions for one in horizons.values()][MOST:]
    return (*lines[:MOST], f"and that of {len(rest)} more scenes ({_count(sum(rest), 'revision')})")


def _told(pruned: Pruned) -> list[str]:
    if not pruned.scenes:
        went = "nothing is old enough to go"
    else:
        verb = "would prune" if pruned.dry_run else "pruned"
        where = f"'{pruned.scenes[0].scene}'" if len(pruned.scenes) == 1 else _count(len(pruned.scenes), "scene")
        went = (
            f"{verb} {_count(pruned.revisions, 'revision')} of {where}: {_count(pruned.rows, 'row')} "
            f"with {_size(pruned.bytes)}"
        )
    if pruned.dry_run:
        last = f"{went}; the ledger has {_size(pruned.size_before)}, nothing was changed"
    elif pruned.size_after == pruned.size_before:
        last = f"{went}; the ledger has {_size(pruned.size_after)}"
    else:
        last = f"{went}; the ledger went from {_size(pruned.size_before)} to {_size(pruned.size_after)}"
    shown = pruned.scenes[:MOST] if len(pruned.scenes) > 1 else ()
    lines = [
        f"'{one.scene}': {_count(one.revisions, 'revision')}, {_count(one.rows, 'row')} with {_size(one.bytes)}; "
        f"kept from revision {one.kept_from} on"
        for one in shown
    ]
    if len(pruned.scenes) > MOST:
        lines.append(f"and {len(pruned.scenes) - MOST} more scenes (--json lists them)")
    return [*lines, last]


def _record(pruned: Pruned) -> dict[str, object]:
    return {
        "dry_run": pruned.dry_run,
        "revisions": pruned.revisions,
        "rows": pruned.rows,
        "bytes": pruned.bytes,
        "size_before": pruned.size_before,
        "size_after": pruned.size_after,
        "scenes": [
            {
                "scene": one.scene,
                "kept_from": one.kept_from,
                "revisions": one.revisions,
                "rows": one.rows,
                "bytes": one.bytes,
            }
            for one in pruned.scenes
        ],
        "notes": list(pruned.notes),
    }


def _count(number: int, what: str) -> str:
    return f"{number:,} {what}{'' if number == 1 else 's'}"


def _size(number: int) -> str:
    return f"{number / 1e6:,.2f} MB" if number >= 100_000 else f"{number / 1e3:,.1f} kB"
