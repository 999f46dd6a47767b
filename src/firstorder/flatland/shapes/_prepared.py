"""Round shapes as searches ask for them: what depends on no ray is found once, before all rays.

Of many rays and shapes each distance is one loop over numbers side by side, with one square root
and one quotient at its end (`scene._intersect`). A structure holds many shapes of its kind, and
`distance` speaks of one.
"""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from firstorder._display import Module
from firstorder.flatland.shapes._base import Point
from firstorder.flatland.shapes._unit_circle import SLACK, under_the_root
from firstorder.numerics._planar import cross_2d, dot_2d
from firstorder.numerics._quadratic import first_root, root_sum
from firstorder.numerics._select import either, grazing


class PreparedEllipses(Module):
    """Ellipses by the maps that make them unit circles.

    Attributes:
        center: of each [m].
        inward: matrix of the map, without the shift [1/m].
    """

    center: Float[Array, "*n 2"]
    inward: Float[Array, "*n 2 2"]

    @property
    def count(self) -> int:
        """Number of shapes."""
        return self.center.shape[0]

    def distance(self, origin: Point, along: Point, on: Bool[Array, ""]) -> Float[Array, ""]:
        """Distance to the nearest point ahead, infinity for none."""
        (xx, xy), (yx, yy) = self.inward
        (x, y), (u, v) = origin - self.center, along
        (x, y), (u, v) = (xx * x + xy * y, yx * x + yy * y), (xx * u + xy * v, yx * u + yy * v)
        a, b = u * u + v * v, x * u + y * v
        c = either(on, 0.0, x * x + y * y - 1.0)
        root_of = under_the_root(a - (x * v - y * u) ** 2, b, on)
        over, under, ahead = first_root(a, b, c, root_of, a)
        return either((root_of > 0.0) & ahead, over, jnp.inf) / under


class PreparedArcs(Module):
    """Arcs by the directions of their ends.

    Attributes:
        center: of each [m].
        radius: likewise [m].
        ends: directions from the middle in which they start and end.
        sweep: how far they turn, counter-clockwise [rad].
    """

    center: Float[Array, "*n 2"]
    radius: Float[Array, "*n"]
    ends: Float[Array, "*n 2 2"]
    sweep: Float[Array, "*n"]

    @property
    def count(self) -> int:
        """Number of shapes."""
        return self.center.shape[0]

    def distance(self, origin: Point, along: Point, on: Bool[Array, ""]) -> Float[Array, ""]:
        """Distance to the nearest point ahead, infinity for none."""
        over, under, there, _ = self.crossing(origin, along, on)
        return either(there, over, jnp.inf) / under

    def crossing(
        self, origin: Point, along: Point, on: Bool[Array, ""]
    ) -> tuple[Array, Array, Bool[Array, ""], Bool[Array, ""]]:
        """The nearest crossing ahead as a quotient, and both conditions of `unit_circle_roots`.

        Search and hit ask alike, so that they agree on a ray that grazes an end.
        """
        w, square = origin - self.center, self.radius * self.radius
        b, c = dot_2d(w, along), either(on, 0.0, dot_2d(w, w) - square)
        most = square * dot_2d(along, along)
        root_of = under_the_root(most - cross_2d(w, along) ** 2, b, on)
        real, ahead = root_of > 0.0, b < 0.0
        sum_of, taken_off = root_sum(b, root_of, most)
        # The farther crossing, and the nearer one, from outside, whose distance is c / sum_of.
        over, under = either(taken_off, sum_of, jnp.abs(c)), either(taken_off, 1.0, sum_of)
        beside = self._rounding(w)
        last = (ahead | (c < 0.0)) & self._holds(under * w + over * along, under * beside)
        first = ahead & (c > 0.0) & self._holds(sum_of * w + c * along, sum_of * beside)
        over, under = either(first, c, over), either(first, sum_of, under)
        met, nearly = first | last, root_of > -SLACK * grazing(most)
        return over, under, real & met, nearly & met

    def _rounding(self, w: Point) -> Float[Array, ""]:
        """How far a hit may lie from its place by rounding."""
        far = jnp.max(jnp.abs(w)) + jnp.max(jnp.abs(self.center)) + self.radius
        return 4.0 * jnp.finfo(far.dtype).eps * far

    def _holds(self, way: Point, beside: Float[Array, ""]) -> Bool[Array, ""]:
        """Whether an arc reaches as far as that direction from its middle.

        Within rounding it reaches beyond its ends, so that no ray passes between what is joined.

        Args:
            way: the direction, of any length.
            beside: its rounding.
        """
        sign, turned, least = jnp.sign(self.sweep), jnp.abs(self.sweep), -beside
        behind = sign * cross_2d(self.ends[0], way) >= least
        before = sign * cross_2d(way, self.ends[1]) >= least
        # Across the middle from an arc as short as rounding both hold too.
        same = dot_2d(self.ends[0] + self.ends[1], way) >= least
        whole = turned >= 2.0 * jnp.pi
        return whole | either(turned <= jnp.pi, behind & before & same, behind | before)
