"""Stores of older formats: they are read as they are, and brought up to date by the first write."""

from __future__ import annotations

from sqlalchemy import Connection, Table, update

from cgdb.errors import VersionError
from cgdb.storage import schema, sqlite


def there(connection: Connection, table: Table) -> bool:
    """Whether a store has a table by its format; one that came later is as good as empty."""
    if not any(table in tables for tables in schema.ADDED.values()):
        return True
    noted = sqlite.user_version(connection)
    return not any(table in tables for since, tables in schema.ADDED.items() if since > noted)


def upgrade(connection: Connection) -> None:
    """Within a transaction that writes: add the tables that came since, and note the format in both its places.

    VersionError where a newer cgdb has brought the store to its own format since it was opened here.
    """
    noted = sqlite.user_version(connection)
    if noted > schema.FORMAT:
        raise VersionError(
            f"a newer cgdb has brought the store to format {noted}; this one knows formats up to {schema.FORMAT}",
            hint="pip install --upgrade cgdb",
        )
    if noted == schema.FORMAT:
        return
    for since, tables in schema.ADDED.items():
        for table in tables if since > noted else ():
            table.create(connection)
    connection.execute(update(schema.meta).where(schema.meta.c.name == "format").values(value=str(schema.FORMAT)))
    sqlite.set_user_version(connection, schema.FORMAT)
