"""Physical steps, one a file: each picks a law and its parameters, and cites its equation."""
