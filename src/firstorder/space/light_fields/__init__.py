"""Scenes as light fields: radiance over a plane, with the outlines for its edges."""

from firstorder.space.light_fields.field import Jump, LightField, light_field

__all__ = [
    "LightField",
    "light_field",
    "Jump",
]
