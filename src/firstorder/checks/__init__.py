"""Why you can believe it: squares, faults, tolerances."""
