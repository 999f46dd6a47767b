"""Events of light transport, one a file: each picks a law, and cites its equation."""
