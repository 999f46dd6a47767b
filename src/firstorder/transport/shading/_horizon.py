"""Light restricted to rays from above the base line."""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from firstorder.conventions import FLATLAND, Frame
from firstorder.fields.field import Affine, Edge, Field
from firstorder.fields.jet import Jet
from firstorder.typing import Array, Ray, Scalar


class AboveLine(Field):
    """Light from above the base line, `|theta| < pi/2` in the global frame, and none from below.

    Light that came through slopes is known there only, and NaN elsewhere; that NaN reaches neither
    values nor derivatives. The horizons `-+ pi/2` become edges, so what integrates the light stops
    there, with the boundary terms of light that does not vanish along the line.

    Args:
        light: light over (x, theta).

    Raises:
        ValueError: if the light is not over (x, theta).

    Example:
        >>> from firstorder.fields import Constant
        >>> from firstorder.transport.shading._horizon import AboveLine
        >>> sky = AboveLine(Constant(1.0))
        >>> sky(0.0, 1.5).item(), sky(0.0, 1.6).item()
        (1.0, 0.0)
    """

    light: Field

    def __check_init__(self):
        """Refuse other coordinates."""
        if self.light.frame.coordinates != FLATLAND.coordinates:
            raise ValueError(
                f"Argument `light` must be over {FLATLAND.coordinates}, "
                f"but is over {self.light.frame.coordinates}."
            )

    @property
    def frame(self) -> Frame:
        """Frame of the light."""
        return self.light.frame

    def _masked(self, function: Callable, u: Ray):
        below = (jnp.cos(u[1]) <= 0) | (jnp.abs(u[1]) >= 0.5 * np.pi)
        safe = jnp.where(below, jnp.zeros_like(u), u)  # no NaN in derivatives either
        return jax.tree.map(lambda a: jnp.where(below, 0.0, a), function(safe))

    def at(self, u: Ray) -> Scalar:
        """The light, or zero."""
        return self._masked(self.light.at, u)

    def jet(self, u: Ray) -> Jet:
        """Jet of the light, or zeros."""
        return self._masked(self.light.jet, u)

    def edges(self) -> tuple[Edge, ...]:
        """Edges of the light, and the two horizons."""
        normal = jnp.array([0.0, 1.0])
        # As far inside as rounding needs for the light to be defined on the edge.
        quarter = 0.5 * np.pi * (1.0 - 4.0 * float(jnp.finfo(normal.dtype).eps))
        ends = tuple(Edge(Affine(s * normal, quarter, self.frame), self.light) for s in (-1.0, 1.0))
        kept = tuple(
            Edge(e.level if isinstance(e.level, Affine) else _Clamped(e.level), AboveLine(e.jump))
            for e in self.light.edges()
        )
        return kept + ends


class _Clamped(Field):
    """A level that is known above the line only, continued by its value at the horizon."""

    level: Field

    @property
    def frame(self) -> Frame:
        """Frame of the level."""
        return self.level.frame

    def _inside(self, u: Ray) -> tuple[Array, Ray]:
        quarter = 0.5 * np.pi * (1.0 - 4.0 * float(jnp.finfo(u.dtype).eps))
        return jnp.abs(u[1]) < quarter, u.at[1].set(jnp.clip(u[1], -quarter, quarter))

    def at(self, u: Ray) -> Scalar:
        """The level at the nearest direction above the line."""
        return self.level.at(self._inside(u)[1])

    def jet(self, u: Ray) -> Jet:
        """Jet of the level, standing still below the line."""
        inside, near = self._inside(u)
        jet = self.level.jet(near)
        still = jax.tree.map(jnp.zeros_like, jet)
        moving = jax.tree.map(lambda a, b: jnp.where(inside, a, b), jet, still)
        return eqx.tree_at(lambda j: j.value, moving, jet.value)
