"""The extent of light: the region that a window must hold."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from firstorder._display import Module
from firstorder.typing import Scalar, as_float

FAR = 8.5  # standard deviations beyond which a bell is below 1e-15 of its height


class Extent(Module):
    """Bells widened by segments: the part of ray space in which a light field does not vanish.

    The light of one part lies within `center + b + sum_k t_k sides_k`, with b inside the ellipsoid
    of the covariance `spread` at some number of standard deviations, and all |t_k| <= 1; a sum of
    lights has several parts. Moves and convolutions act on it exactly; a product only makes it
    smaller.

    Args:
        center: one row per part [units of the coordinates].
        spread: one covariance matrix per part, zero for light with an end.
        sides: segments of each part, one per row, zeros for a bell.

    Example:
        >>> from firstorder.fields import gaussian
        >>> low, high = gaussian((1.0, 0.0), (0.5, 0.1)).spectrum().extent().along([1.0, 0.0], 2.0)
        >>> round(low.item(), 12), round(high.item(), 12)
        (0.0, 2.0)
    """

    center: Float[Array, "p n"] = eqx.field(converter=as_float)
    spread: Float[Array, "p n n"] = eqx.field(converter=as_float)
    sides: Float[Array, "p k n"] = eqx.field(converter=as_float)

    @classmethod
    def bell(cls, center: Float[Array, " n"], spread: Float[Array, "n n"]) -> Extent:
        """Light about a centre, without an end.

        Args:
            center: where [units of the coordinates].
            spread: its covariance, of the coordinates themselves.

        Example:
            >>> import jax.numpy as jnp
            >>> from firstorder.fields import Extent
            >>> low, high = Extent.bell(jnp.zeros(2), jnp.eye(2)).along([1.0, 0.0], 3.0)
            >>> low.item(), high.item()
            (-3.0, 3.0)
        """
        return cls(center[None], spread[None], jnp.zeros((1, 0, center.size)))

    @classmethod
    def box(cls, center, half_widths) -> Extent:
        """Light inside a box.

        Args:
            center: n numbers.
            half_widths: n numbers.

        Example:
            >>> from firstorder.fields import Extent
            >>> low, high = Extent.box((0.0, 0.0), (1.0, 0.5)).along([1.0, 2.0])
            >>> low.item(), high.item()
            (-2.0, 2.0)
        """
        sides = jnp.diag(jnp.stack([as_float(w) for w in half_widths]))[None]
        middle = jnp.stack([as_float(c) for c in center])[None]
        return cls(middle, jnp.zeros_like(sides), sides)

    def __add__(self, other: Extent) -> Extent:
        """Extent of the sum of two lights."""
        k = max(self.sides.shape[1], other.sides.shape[1])
        padded = [
            jnp.pad(e.sides, ((0, 0), (0, k - e.sides.shape[1]), (0, 0))) for e in (self, other)
        ]
        centers = jnp.concatenate([self.center, other.center])
        return Extent(
            centers, jnp.concatenate([self.spread, other.spread]), jnp.concatenate(padded)
        )

    def along(self, normal, deviations: float = FAR) -> tuple[Scalar, Scalar]:
        """Smallest and largest value of `normal . u` where the light lies.

        Args:
            normal: of the linear form.
            deviations: how many standard deviations of a bell count.
        """
        normal = as_float(normal)
        variance = jnp.einsum("i,pij,j->p", normal, self.spread, normal)
        bell = variance > 0
        width = jnp.where(bell, deviations * jnp.sqrt(jnp.where(bell, variance, 1.0)), 0.0)
        width = width + jnp.sum(jnp.abs(self.sides @ normal), axis=-1)
        middle = self.center @ normal
        return jnp.min(middle - width), jnp.max(middle + width)

    def moved(self, A: Float[Array, "m n"], b: Float[Array, " m"]) -> Extent:
        """The image under `A u + b`."""
        return Extent(self.center @ A.T + b, A @ self.spread @ A.T, self.sides @ A.T)

    def widened(self, axis: int, deviation, reach) -> Extent:
        """After a convolution along an axis with a kernel of this deviation and this reach."""
        along = jnp.eye(self.center.shape[1], dtype=self.center.dtype)[axis]
        side = jnp.broadcast_to(reach * along, (self.center.shape[0], 1, along.size))
        spread = self.spread + deviation**2 * along[:, None] * along
        return Extent(self.center, spread, jnp.concatenate([self.sides, side], axis=1))
