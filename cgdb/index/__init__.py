"""What is derived from the ledger and can be thrown away: files kept by artefacts, opened by columns, graph, vectors."""
