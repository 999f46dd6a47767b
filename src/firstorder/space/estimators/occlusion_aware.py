"""Irradiance with an occlusion-aware gradient and Hessian, from a triangulated hemisphere.

Gather rays hit points; the points, joined to triangles, are emitters that stay where they are
while the receiver moves. Where two neighbours lie at depths that differ, the nearer surface ends
half way between them and hides the farther one: that boundary moves as the nearer surface does.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from firstorder._argument_checks import (
    check_inside,
    check_positive,
    check_shape,
    is_concrete,
    traced_nan_unless,
)
from firstorder.scene._arguments import numbers
from firstorder.space.silhouettes._lambert_edge_term import lambert_edge
from firstorder.typing import as_array

# Neighbours whose inverse distances differ by more than this fraction lie on two surfaces.
STEP = 0.3
# The crossing of two edges runs along both like 1 / sin of the angle between them. A grid tells
# small angles badly: below about this sine the crossing is taken to run less. Of 0.03 to 1 in the
# square, 0.3 left the least median error at 256, 1024 and 4096 rays.
SLANT = 0.55


def occlusion_aware_estimate(
    radiance: ArrayLike,
    directions: ArrayLike,
    distances: ArrayLike,
    triangles: ArrayLike,
    neighbours: ArrayLike | None = None,
    step: float = STEP,
) -> tuple[Float[Array, ""], Float[Array, "2"], Float[Array, "2 2"]]:
    """Irradiance of a receiver, its gradient and its Hessian along the receiver's plane.

    `E = sum over edges of (radiance on the left - radiance on the right) F(edge)`, F being
    Lambert's term of an edge (`lambert_edge`), and the derivatives are those of F for ends that
    are fixed in space. Triangles whose corners lie on two surfaces are cut half way, at the nearer
    distance. The Hessian has one more term, where the light L' at r' seen past an edge at r varies:
    `-oint (1/r - 1/r')^2 (n . d) (grad L' . d) du` in projected directions u; without it the edge
    would drag along the light behind it. It needs `neighbours`.

    Valid for surfaces whose radiance does not depend on the direction, seen past sharp edges. Wrong
    past the contour of a curved surface, which slides over it: the boundary's part of the Hessian
    is
    then off by about its radius of curvature over its distance. Light below the horizon is none.

    Args:
        radiance: of each gather ray, shape (m,) [W/(m^2 sr)].
        directions: shape (m, 3), unit vectors in the receiver's frame, z > 0.
        distances: to what each ray meets, shape (m,) [m]; `inf` for a ray that meets nothing. An
            environment is at infinity and does not move.
        triangles: shape (k, 3), neighbours on the hemisphere, counter-clockwise as x turns to y;
            i + m is the foot of ray i on the horizon. They must cover the hemisphere once:
            `hemisphere_triangulation`.
        neighbours: shape (m, q), of each ray, as many as there are within some steps; a ray itself
            stands for none. Without them the varying light behind an edge is left out.
        step: fraction by which inverse distances differ across an edge.

    Returns:
        E [W/m^2], gradient [W/m^3] and Hessian [W/m^4] in the receiver's tangent axes.

    Raises:
        ValueError: if there are not as many radiances, distances and neighbours as directions, a
            triangle or a neighbour names a ray that is not there, a direction is no unit vector
            above the horizon, a distance is not positive (a traced one gives NaN), or `step` lies
            outside (0, 1).

    Reference: after Schwarzhaupt, Jensen and Jarosz 2012, as J12 §9 asks; derived afresh.

    Example:
        >>> import jax, jax.numpy as jnp
        >>> from firstorder.space.estimators import hemisphere_triangulation
        >>> from firstorder.space.estimators import occlusion_aware_estimate
        >>> net = hemisphere_triangulation(64)
        >>> sky = jnp.ones(64), net.directions, jnp.full(64, jnp.inf)
        >>> E, gradient, hessian = jax.jit(occlusion_aware_estimate)(*sky, net.triangles,
        ...     net.neighbours)
        >>> round(float(E), 5), float(abs(hessian).max())
        (3.14159, 0.0)
    """
    L, w, r = (
        numbers(name, a)
        for name, a in (
            ("radiance", radiance),
            ("directions", directions),
            ("distances", distances),
        )
    )
    triangles, neighbours = as_array(triangles), _as_rows(neighbours)
    _check_net(L, w, r, triangles, neighbours)
    check_inside("step", step, 0.0, 1.0)
    r = traced_nan_unless(lambda a: a > 0.0, r)
    points, L = _points(w, r), jnp.concatenate([L, L])
    parts = _cut(points[:, triangles.T], L[triangles.T], step)
    E, gx, gy, xx, xy, yy = _contours(parts)
    hessian = jnp.stack([jnp.stack([xx, xy]), jnp.stack([xy, yy])])
    if neighbours is not None:
        hessian = hessian + _uncovered(points, parts, triangles.T, neighbours, step)
    return E, jnp.stack([gx, gy]), hessian


def _check_net(radiance, directions, distances, triangles, neighbours) -> None:
    """Refuse rays that do not go with their triangulation: JAX reads others in their place."""
    rays = directions.shape[0]
    check_shape("directions", directions, (rays, 3))
    check_shape("radiance", radiance, (rays,))
    check_shape("distances", distances, (rays,))
    check_shape("triangles", triangles, (len(triangles), 3))
    _check_named("triangles", triangles, 2 * rays, f"{rays} rays and their feet")
    if neighbours is not None:
        each = neighbours.shape[1] if neighbours.ndim > 1 else 1
        check_shape("neighbours", neighbours, (rays, each))
        _check_named("neighbours", neighbours, rays, f"{rays} rays")
    if is_concrete(distances):
        check_positive("distances", np.where(np.isposinf(distances), 1.0, distances))
    if is_concrete(directions):
        length, up = np.linalg.norm(directions, axis=1), np.asarray(directions)[:, 2]
        wrong = np.flatnonzero(~((abs(length - 1.0) < 1e-4) & (up >= 0.0)))
        if wrong.size:
            raise ValueError(
                "Argument `directions` must hold unit vectors above the horizon, but holds "
                f"{directions[wrong[0]]}."
            )


def _check_named(name, rows, count: int, words: str) -> None:
    """Refuse what are no numbers of rays, and numbers of rays that are not there."""
    if not jnp.issubdtype(rows.dtype, jnp.integer):
        raise ValueError(f"Argument `{name}` must name {words}, but holds {rows.dtype}.")
    if not is_concrete(rows) or not rows.size:
        return
    least, most = int(np.min(rows)), int(np.max(rows))
    if not 0 <= least <= most < count:
        raise ValueError(
            f"Argument `{name}` must name {words}, but names {least if least < 0 else most}."
        )


def _as_rows(neighbours):
    """Neighbours as an array, if there are any."""
    return None if neighbours is None else jnp.atleast_1d(as_array(neighbours))


def _points(directions, distances) -> Float[Array, "4 n"]:
    """`(w, 1/r)` of every hit, and of its foot: the point below it in the receiver's plane."""
    w = directions.T
    there = ~jnp.isposinf(distances)
    s = jnp.where(there, 1.0 / jnp.where(there, distances, 1.0), 0.0)
    flat = w[0] ** 2 + w[1] ** 2
    up = flat > 0.0
    wide = jnp.where(up, 1.0 / jnp.sqrt(jnp.where(up, flat, 1.0)), 0.0)
    foot = [jnp.where(up, w[0] * wide, 1.0), w[1] * wide, jnp.zeros_like(s), s * wide]
    return jnp.concatenate([jnp.concatenate([w, s[None]]), jnp.stack(foot)], 1)


class _Parts(NamedTuple):
    """Triangles, each in four parts: one at each corner, and what is between those."""

    at: Float[Array, "4 3 k"]  # corners
    middle: Float[Array, "4 3 k"]  # half way from corner i to corner i + 1
    cut: Array  # (3, k): whether that side passes from one surface to another
    L: Float[Array, "3 k"]  # radiance at the corners
    light: Float[Array, "3 k"]  # of the part at each corner
    centre: Float[Array, " k"]  # of the part between


def _cut(at, L, step) -> _Parts:
    """The four parts of each triangle.

    The sum of two points, as four numbers each, is on the chord between them, half way in
    direction; a side between two surfaces has there the nearer distance instead. Radiance is
    linear along a surface, and constant from a corner up to a cut.
    """
    after = jnp.roll(at, -1, 1)
    s, t = at[3], after[3]
    near = jnp.maximum(s, t)
    cut = jnp.abs(s - t) > step * near
    total = at[:3] + after[:3]
    length = jnp.sqrt(jnp.maximum(jnp.sum(total**2, 0), jnp.finfo(at.dtype).tiny))
    inverse = jnp.where(cut, near, (s + t) / length)
    middle = jnp.concatenate([total / length, inverse[None]])
    M = 0.5 * (L + jnp.roll(L, -1, 0))
    ahead = jnp.where(cut, L, M)
    behind = jnp.where(jnp.roll(cut, 1, 0), L, jnp.roll(M, 1, 0))
    whole = jnp.where(cut, 0.0, 1.0).astype(L.dtype)
    sides = jnp.sum(whole, 0)
    mean = jnp.sum(whole * M, 0) / jnp.maximum(sides, 1.0)
    # Between three surfaces the farthest shows: it is what the others uncover.
    farthest = jnp.take_along_axis(L, jnp.argmin(s, 0)[None], 0)[0]
    centre = jnp.where(sides > 0, mean, farthest)
    return _Parts(at, middle, cut, L, (L + ahead + behind) / 3.0, centre)


def _contours(c: _Parts) -> Float[Array, " 6"]:
    """Lambert's terms with the jumps of radiance across them, summed over the hemisphere."""
    start = jnp.concatenate([c.at, c.middle, c.middle], 1)
    end = jnp.concatenate([c.middle, jnp.roll(c.at, -1, 1), jnp.roll(c.middle, 1, 1)], 1)
    jumps = jnp.concatenate([c.light, jnp.roll(c.light, -1, 0), c.light - c.centre])
    return jnp.sum(jumps * lambert_edge(start, end), (1, 2))


def _uncovered(points, c: _Parts, corners, neighbours, step) -> Float[Array, "2 2"]:
    """Contribution to the Hessian of the light that varies behind nearer edges.

    Along an edge that light changes by what the far corners differ by, which sums up exactly
    however the triangles zigzag; across it, by a mean gradient where it is smooth, and where it
    jumps by the direction of that other edge.
    """
    count = neighbours.shape[0]
    s, u = points[3], points[:2]
    fields = _carried(points, c, corners)
    s0 = s[:count]

    def gather(total, j):
        far, apart = s[j] < (1.0 - step) * s0, (s0 - s[j]) ** 2
        own = jnp.abs(s[j] - s0) <= step * jnp.maximum(s[j], s0)
        weights = [own, own, far, far, far * apart, far * apart, far]
        return total + fields[:7, j] * jnp.stack(weights), None

    begin = fields[:7, :count] * jnp.array([1.0, 1.0, 0, 0, 0, 0, 0], u.dtype)[:, None]
    total, _ = jax.lax.scan(gather, begin, jnp.asarray(neighbours).T)
    some = total[6] > 0.0
    smooth = jnp.where(some, total[4:6] / jnp.where(some, total[6], 1.0), 0.0)
    # The cuts around a lone ray close: what their sum is then is rounding, and no direction.
    normal, other = _unit(total[:2], float(jnp.finfo(u.dtype).eps)), _unit(total[2:4])
    along = -_turned(normal)
    across, ahead = jnp.sum(other * normal, 0), jnp.sum(other * along, 0)
    slide = across * ahead / (ahead**2 + SLANT**2)
    v = u[:, :count]
    # A step d moves what is at r by -(d - u (u . d)) / r.
    N, smooth, normal, jump = (
        a - v * jnp.sum(v * a, 0)
        for a in (fields[:2, :count], smooth, normal, along + normal * slide)
    )
    H = -jnp.einsum("im,jm->ij", N, smooth)
    H = H - jnp.einsum("m,im,jm->ij", fields[7, :count], normal, jump)
    return 0.5 * (H + H.T)


def _carried(points, c: _Parts, corners) -> Float[Array, "8 n"]:
    """Sums that each point carries for the triangles in which it is nearest.

    The normals of the cuts past it, outward times length (2); `int grad L du` where L jumps (2)
    and where it is smooth (2), and the area of the latter; the jumps of L behind it, along the
    edge, times the squared difference of inverse distances.
    """
    s = c.at[3]
    nearer = s > jnp.roll(s, -1, 0)
    # From the middle of one triangle to that of the next: the point between them cancels.
    normal = _turned(jnp.mean(c.middle[:2], 1, keepdims=True))
    normal = jnp.where(c.cut, jnp.where(nearer, normal, -normal), 0.0)
    owner = jnp.where(nearer, corners, jnp.roll(corners, -1, 0))
    opposite = jnp.roll(c.at[:2], 1, 1) - jnp.roll(c.at[:2], -1, 1)
    rise = -0.5 * jnp.sum(c.L * _turned(opposite), 1)
    area = 0.5 * (opposite[0, 2] * opposite[1, 0] - opposite[1, 2] * opposite[0, 0])
    # -- a side of light that jumps: to another surface, or to less than half
    after = jnp.roll(c.L, -1, 0)
    change = after - c.L
    jumps = c.cut | (jnp.abs(change) > 0.5 * jnp.maximum(jnp.abs(c.L), jnp.abs(after)))
    abrupt = jnp.any(jumps, 0).astype(s.dtype)
    # -- behind the nearest corner, the side opposite: from the corner after it to the one before
    nearest = jnp.argmax(s, 0)[None]
    first = jnp.take_along_axis(corners, nearest, 0)[0]
    cut_both = c.cut & jnp.roll(c.cut, 1, 0)
    behind = jnp.maximum(jnp.roll(s, -1, 0), jnp.roll(s, 1, 0))
    passed = jnp.where(cut_both & jnp.roll(jumps, -1, 0), jnp.roll(change, -1, 0), 0.0)
    passed = jnp.take_along_axis(passed * (s - behind) ** 2, nearest, 0)[0]
    rows = [*(abrupt * rise), *((1.0 - abrupt) * rise), (1.0 - abrupt) * area, passed]
    fields = jnp.zeros((8, points.shape[1]), s.dtype)
    return fields.at[:2, owner].add(normal).at[2:, first].add(jnp.stack(rows))


def _unit(v, least=0.0):
    """Vectors of length one; zero where their square is no more than the least."""
    size = jnp.sum(v**2, 0)
    there = size > least
    return jnp.where(there, v / jnp.sqrt(jnp.where(there, size, 1.0)), 0.0)


def _turned(v):
    """A quarter turn clockwise: from the way around an outline to its outward normal."""
    return jnp.stack([v[1], -v[0]])
