"""Reflected light of a curved surface in closed form, and the camera that looks at it."""
