"""A statement to its answer: run is the flow, through binder, planner, executor and answer."""
