"""Stills of our own, 1920 x 1080, drawn by `make gallery`; beside them the README's pictures."""
