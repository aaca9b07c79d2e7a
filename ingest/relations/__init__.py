"""Relations from geometry: `boxes` finds near pairs, `spatial` says what they are to each other, `relate` adds them."""
