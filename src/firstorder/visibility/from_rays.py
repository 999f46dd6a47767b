"""Shadow edges from visibility rays: the image-space route, for unknown shapes.

Rays at a few hundred angles say "blocked" or "free". Where neighbours differ there is an edge: it
is bisected to rounding, with a fixed number of rays. Then the *point of tangency*, where the ray of
the edge touches the blocker, is found from hits beside it. One hit is not enough: on a round
blocker the first hit at an angle delta inside the edge lies `sqrt(2 r D delta)` before that, so
that its error is the square root of the step. In `s = sqrt(delta)` however the distance is smooth,
for a corner too; a polynomial through a few hits gives D at s = 0, and its slope the radius of
curvature, which the second derivative of the edge angle asks for.

What this route cannot see: a blocker, or a gap, narrower than the step between two rays.
"""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Bool, Float, Int

from firstorder._argument_checks import check_count, check_finite, check_positive, nan_unless
from firstorder._display import Module
from firstorder.typing import as_float
from firstorder.visibility.edge_angles import EdgeAngle, edge_at

# Angles of any shape, to whether the ray is blocked; or to the distance of its first hit.
Blocked = Callable[[Array], Array]
Hit = Callable[[Array], Array]


class BracketedEdges(Module):
    """Edges of sampled visibility; slots that are not used have sign 0.

    Attributes:
        angle: of the edges, in order [rad].
        sign: +1 from free to blocked as angles grow, -1 from blocked to free (R07 Fig. 8).
        count: how many edges there are; if more than slots, all angles are NaN.
    """

    angle: Float[Array, " m"]
    sign: Float[Array, " m"]
    count: Int[Array, ""]


class TangentPoints(Module):
    """Points at which the rays at shadow edges touch their blockers.

    Attributes:
        angle: local angle of the edge [rad].
        sign: as in `BracketedEdges`; 0 for an empty slot.
        distance: D, to the point of contact [m].
        radius: of the blocker's curvature there; zero, to rounding, at a corner [m].
    """

    angle: Float[Array, " m"]
    sign: Float[Array, " m"]
    distance: Float[Array, " m"]
    radius: Float[Array, " m"]

    @property
    def normal(self) -> Float[Array, " m"]:
        """Local angle of the blocker's outward normal at that point, across the ray [rad]."""
        return self.angle - 0.5 * jnp.pi * self.sign

    def edges(self) -> EdgeAngle:
        """The edges by all motions of the receiver (see `edge_at`); empty slots jump by 0."""
        shown = jnp.isfinite(self.distance)
        D = jnp.where(shown, self.distance, 1.0)
        found = edge_at(
            jnp.where(shown, self.angle, 0.0),
            1.0 / D,
            self.sign,
            -self.sign * jnp.where(shown, self.radius, 0.0) / D**3,
        )

        def known(a):
            return nan_unless(shown.reshape(-1, *[1] * (a.ndim - 1)), a)

        return EdgeAngle(*map(known, (found.value, found.gradient, found.hessian)), found.jump)


def bracket_edges(
    blocked: Blocked, angles: ArrayLike, size: int = 16, steps: int | None = None
) -> BracketedEdges:
    """Edges between sampled angles, bisected all at once.

    The angles carry no derivative; `tangent_points` and its `edges` do.

    Args:
        blocked: whether rays are blocked, elementwise on arrays of angles.
        angles: where to sample, growing, shape (n,) [rad].
        size: slots for edges.
        steps: bisections; left out, as many as the precision has bits.

    Raises:
        ValueError: if an angle is not finite or not above the one before, or `size` is no positive
            integer.

    Reference: R07 §6.3, where the edge is the sampled angle itself.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.visibility import bracket_edges
        >>> found = bracket_edges(lambda a: jnp.abs(a) < 0.3, jnp.linspace(-1.0, 1.0, 20), size=2)
        >>> found.angle.round(6).tolist(), found.sign.tolist()
        ([-0.3, 0.3], [1.0, -1.0])
    """
    check_count("size", size)
    check_finite("angles", angles)
    angles = jax.lax.stop_gradient(as_float(angles))
    check_positive("angles[k + 1] - angles[k]", jnp.diff(angles))
    seen: Bool[Array, " n"] = blocked(angles)
    changes = seen[1:] != seen[:-1]
    count = jnp.sum(changes)
    (at,) = jnp.nonzero(changes, size=size, fill_value=0)
    used = jnp.arange(size) < count
    before = seen[at]

    def halve(_, ends):
        low, high = ends
        middle = 0.5 * (low + high)
        same = blocked(middle) == before
        return jnp.where(same, middle, low), jnp.where(same, high, middle)

    bits = steps if steps is not None else jnp.finfo(angles.dtype).nmant + 1
    low, high = jax.lax.fori_loop(0, bits, halve, (angles[at], angles[at + 1]))
    edge = jnp.where(used, 0.5 * (low + high), 0.0)
    sign = jnp.where(used, jnp.where(before, -1.0, 1.0), 0.0).astype(angles.dtype)
    return BracketedEdges(nan_unless(count <= size, edge), sign, count)


def tangent_points(
    hit: Hit, edges: BracketedEdges, reach: float = 1e-3, points: int = 6
) -> TangentPoints:
    """The points at which the rays at the edges touch their blockers.

    Hits at `delta_k = reach (k / points)^2` inside the edge, k = 1 ... points, and the polynomial
    in sqrt(delta) through them: D is its value at zero, and `r = slope^2 / (2 D)`.

    Valid when: the blocker is the nearest surface over `reach`, and there smooth but for the corner
    that may be the edge itself; NaN if a ray there finds nothing.

    Args:
        hit: distance of the first hit, elementwise on arrays of angles; infinity for none.
        edges: from `bracket_edges`.
        reach: how far inside the edge to look [rad].
        points: hits for each edge. More are better in float64; three suit float32.

    Raises:
        ValueError: if `reach` or `points` is not positive.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.visibility import bracket_edges, tangent_points
        >>> def hit(a):  # a disc of radius 1 about (0, 2)
        ...     inside = 1.0 - 4.0 * jnp.sin(a) ** 2
        ...     root = jnp.sqrt(jnp.where(inside > 0, inside, 1.0))
        ...     return jnp.where(inside > 0, 2.0 * jnp.cos(a) - root, jnp.inf)
        >>> edges = bracket_edges(lambda a: hit(a) < jnp.inf, jnp.linspace(-1.5, 1.5, 64), size=2)
        >>> found = tangent_points(hit, edges)
        >>> found.distance.round(6).tolist(), found.radius.round(4).tolist()
        ([1.732051, 1.732051], [1.0, 1.0])
    """
    check_positive("reach", reach)
    check_count("points", points)
    k = np.arange(1, points + 1)
    dtype = edges.angle.dtype
    delta = jnp.asarray(reach * (k / points) ** 2, dtype)
    t = hit(edges.angle[:, None] + edges.sign[:, None] * delta)
    good = jnp.all(jnp.isfinite(t), -1) & (edges.sign != 0)
    t = jnp.where(good[:, None], t, 1.0)
    value, slope = _at_zero(points)
    D = t @ jnp.asarray(value, dtype)
    bend = t @ jnp.asarray(slope, dtype) * (points / np.sqrt(reach))
    shown = (edges.sign == 0) | good
    return TangentPoints(
        edges.angle, edges.sign, nan_unless(shown, D), nan_unless(shown, bend**2 / (2 * D))
    )


def _at_zero(points: int) -> tuple[np.ndarray, np.ndarray]:
    """Weights of the values at 1 ... points that give value and slope of their polynomial at 0."""
    inverse = np.linalg.inv(np.vander(np.arange(1.0, points + 1.0), increasing=True))
    return inverse[0], inverse[min(1, points - 1)] * (points > 1)
