"""How good a map is, against a truth: `mapping` scores objects and points."""
