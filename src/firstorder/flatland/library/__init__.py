"""Scenes that ship by name, E11's occluders, bumps."""

from firstorder.flatland.library.scenes import named, names

__all__ = ["names", "named"]
