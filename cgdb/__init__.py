"""cgdb: an embedded store for the 3D scene graphs that robots make."""
