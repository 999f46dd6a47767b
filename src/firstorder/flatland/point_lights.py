"""Lights of flatland without size."""

from __future__ import annotations

from typing import ClassVar

import equinox as eqx
from jaxtyping import Array, Float

from firstorder._argument_checks import check_finite, check_not_negative, not_negative
from firstorder._display import Module
from firstorder.flatland.shapes._base import column, rows


class PointLights(Module):
    """Lights without size, of the same intensity in all directions: `E = I cos(theta) / r`.

    Args:
        position: shape (p, 2) or (2,) [m].
        intensity: shape (p,) or a number, or (p, bands), not negative [W/rad].

    Raises:
        ValueError: if a number is not finite, an intensity negative, or not each light has its own.

    Example:
        >>> from firstorder.flatland import PointLights
        >>> PointLights((0.5, 0.5), 1.0).position.shape
        (1, 2)
    """

    BANDED: ClassVar = {"intensity": 1}

    position: Float[Array, "p 2"] = eqx.field(converter=lambda p: rows(p))
    intensity: Float[Array, "p *bands"] = eqx.field(converter=lambda i: not_negative(column(i)))

    def __check_init__(self):
        """Refuse light that is no light."""
        check_finite("position", self.position)
        check_not_negative("intensity", self.intensity)
        if self.position.shape[0] != self.intensity.shape[0]:
            raise ValueError(
                f"Argument `intensity` must hold {self.position.shape[0]} lights, "
                f"but holds {self.intensity.shape[0]}."
            )
