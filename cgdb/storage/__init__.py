"""The ledger, the one truth of a store: schema, rows, writer, reader, history, and what guards them."""
