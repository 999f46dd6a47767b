"""Cases of light in space, over four coordinates."""
