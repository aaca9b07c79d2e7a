"""What is derived from the ledger and can be thrown away: artefacts keeps the files of columns, graph and vectors."""
