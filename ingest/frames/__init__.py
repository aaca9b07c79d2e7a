"""Recordings of posed RGB-D frames: `recording` is the type and the stream; one module per layout."""
