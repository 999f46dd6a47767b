"""Reflected light of one surface in closed form, and the camera that looks at it."""
