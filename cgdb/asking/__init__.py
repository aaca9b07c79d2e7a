"""Questions in plain words to answers: ask is the flow, from intake to answer."""
