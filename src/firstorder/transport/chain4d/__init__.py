"""Shading chains in space: events over the four coordinates of a ray."""
