"""Files to scene graphs."""
