"""Lines in which two planes meet: the light changes there, and neither plane ends.

Seen from an eye, a line without ends is half a great circle. With m its nearest point and d its
direction, the ways to its points are

    m cos t + |m| d sin t,    -pi/2 < t < pi/2,

an arc about the eye, as a plane's horizon is one. The points themselves lie at those over `cos t`.
"""

from __future__ import annotations

import dataclasses
import itertools

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from firstorder.numerics._scale import power_of_two
from firstorder.numerics._select import either
from firstorder.numerics._vectors import cross, dot, norm, orthonormal_frame
from firstorder.space.scene import Scene
from firstorder.space.shapes.kinds import Planes
from firstorder.space.silhouettes.analytic import _Outlines

ROUNDINGS = 16.0  # in the sine between two normals, below which planes are parallel


def pairs_of_planes(scene: Scene) -> list[tuple[int, int]]:
    """Numbers of all pairs of planes."""
    kinds = [type(group) for group in scene.groups for _ in range(group.count)]
    planes = [number for number, kind in enumerate(kinds) if kind is Planes]
    return list(itertools.combinations(planes, 2))


def common_line(
    n: Float[Array, "*l 3"], m: Float[Array, "*l 3"], h: Float[Array, "*l"], k: Float[Array, "*l"]
) -> tuple[Float[Array, "*l 3"], Float[Array, "*l 3"], Bool[Array, "*l"]]:
    """The lines in which planes `n . p = h` and `m . p = k` meet.

    Of planes that are all but parallel the line is far away, and its place along them is known to a
    rounding over their angle. Its distance from the first plane is zero to rounding at any angle.

    Args:
        n: unit normals.
        m: those of the other planes.
        h: how far the planes are along those [m].
        k: the same of the others [m].

    Returns:
        The point nearest to the origin [m], the direction of n x m, and whether there is a line; of
        parallel planes the first two are some line's on the first plane.
    """
    # Products with the difference of the normals keep the digits of planes that are all but
    # parallel: what points along them must, for their line is far away.
    facing = jnp.where(dot(n, m) < 0.0, -1.0, 1.0)[..., None]
    h, k, apart = facing * h[..., None], k[..., None], m - facing * n
    along = cross(n, apart)
    square = dot(along, along)[..., None]
    meet = square > (ROUNDINGS * jnp.finfo(square.dtype).eps) ** 2
    along = either(meet, along / jnp.sqrt(either(meet, square, 1.0)), orthonormal_frame(n)[..., 0])
    beside = cross(along, n)
    slope = either(meet, dot(apart, beside)[..., None], jnp.inf)
    reach = (k - h + 0.5 * h * dot(apart, apart)[..., None]) / slope
    return facing * h * n + reach * beside, along, meet[..., 0]


def _half_circles(n: Array, m: Array, h: Array, k: Array) -> tuple[Array, Array]:
    """Lines in which planes meet, as arcs about the origin; and whether the origin sees them.

    To the left of an arc lies what the first plane shows: it is nearer where, with the side of the
    arc `m cos t x d`, a step there makes `h / (n . p)` the smaller one.

    Args:
        n: as `common_line` takes them, in rows.
        m: likewise.
        h: likewise.
        k: likewise.
    """
    size = power_of_two(jnp.stack([h, k], -1))
    nearest, along, meet = common_line(n, m, h / size, k / size)
    seen = (meet & (h != 0.0) & (k != 0.0))[:, None]
    far = jnp.sqrt(either(seen, dot(nearest, nearest)[:, None], 1.0))
    ahead = jnp.where(((h > 0.0) == (k > 0.0))[:, None], far, -far) * along
    arcs = size[:, None, None] * jnp.stack([jnp.zeros_like(ahead), nearest, ahead], 1)
    return arcs, seen[:, 0]


def with_common_lines(found: _Outlines, scene: Scene, frame: Float[Array, "3 3"]) -> _Outlines:
    """Silhouettes with the lines in which planes meet behind all other arcs.

    The first plane of a pair is the owner: it lies to the left, and the other one behind.

    Args:
        found: the silhouettes.
        scene: the shapes.
        frame: axes in which the silhouettes are given, as columns.
    """
    meeting = tuple(pairs_of_planes(scene))
    if not meeting:
        return found
    pairs = np.array(meeting)
    normals, heights = [], []
    for which in pairs.T:
        # Row n of `turn` times a way is its height above the plane, in lengths of the normal.
        n = found.turn[which, 2]
        size = norm(n)
        normals.append(n / size[:, None] @ frame)
        heights.append(-found.eye[which, 2] / size * found.unit[which] / found.unit[pairs[:, 0]])
    arcs, meet = _half_circles(*normals, *heights)
    live = jnp.all(jnp.stack([~(found.inside | found.own)[which] for which in pairs.T]), 0)
    quarter = jnp.full(len(pairs), 0.5 * np.pi, arcs.dtype)
    return dataclasses.replace(
        found,
        arcs=jnp.concatenate([found.arcs, arcs]),
        first=jnp.concatenate([found.first, -quarter]),
        last=jnp.concatenate([found.last, quarter]),
        arcs_live=jnp.concatenate([found.arcs_live, live & meet]),
        meeting=meeting,
    )


def lines_of(
    a: Float[Array, "c 3"], b: Float[Array, "c 3"], p: Float[Array, "c n 3"]
) -> tuple[Float[Array, "c n 3"], Float[Array, "c n 3"]]:
    """Points of lines, and their derivatives in the angle, from points of their half circles.

    The ends of a half circle are infinitely far; here they are far.

    Args:
        a: radii to the nearest points of the lines [m].
        b: radii along the lines, as long.
        p: points on the half circles [m].
    """
    square = dot(a, a)[:, None]
    cos, sin = (jnp.einsum("cni,ci->cn", p, e) / square for e in (a, b))
    cos = jnp.maximum(cos, jnp.finfo(cos.dtype).eps)
    cos, tan = cos[..., None], (sin / cos)[..., None]
    return a[:, None] + tan * b[:, None], b[:, None] / cos**2
