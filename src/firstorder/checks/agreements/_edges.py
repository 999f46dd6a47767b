"""Irradiance by the edges of visibility alone: signed exposed ends, each with its closed form.

Every light is an interval of angles behind the intervals of its blockers. With U the union of the
blockers before it and `m(X) = int over X of L cos(a) da`,

    E = sum over lights of m(light or U) - m(U)

Both are unions of intervals, of which only exposed ends count; each end moves by R07 (36) with the
second derivative of `visibility.edge_angles`. No gap is searched for what is seen in it: of two
disjoint convex shapes the same one is in front on every ray that meets both, so that one ray for
each pair says who blocks whom.
"""

from __future__ import annotations

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from firstorder.checks.agreements._record import Found
from firstorder.checks.tolerance import rounding
from firstorder.errors import Refused
from firstorder.flatland._reference import reference_nearest
from firstorder.flatland.scene import Scene
from firstorder.flatland.shapes.kinds import Circles, Segments
from firstorder.flatland.visible import HORIZON, Receiver
from firstorder.visibility import (
    EdgeAngle,
    circle_edge_angle,
    edge_at,
    point_edge_angle,
    shading_derivatives,
    visible_edges,
)

NODES = 48  # of the sky's quadrature between neighbouring edges


class Span(NamedTuple):
    """The angles that one shape takes.

    Attributes:
        low, high: both ends as edges of a blocker.
        emission: of the side that is seen.
    """

    low: EdgeAngle
    high: EdgeAngle
    emission: float

    @property
    def ends(self) -> tuple[float, float]:
        """Lower and upper end, the short way round and within the horizon."""
        a, b = float(self.low.value), float(self.high.value)
        turn = 2.0 * np.pi * np.round((b - a) / (2.0 * np.pi))
        a, b = min(a, b - turn), max(a, b - turn)
        if 0.5 * (a + b) < -np.pi:
            a, b = a + 2.0 * np.pi, b + 2.0 * np.pi
        return max(a, -HORIZON), min(b, HORIZON)


def by_edges(scene: Scene, at: Receiver, scales) -> tuple[Found, ...]:
    """E, E' and E'' along the tangent from the closed forms of all exposed edges.

    Valid when: all shapes are segments and circles that do not cross, and the receiver is outside
    of each. Point lights have their own closed form, behind the same blockers.

    Args:
        scene: concrete shapes and lights.
        at: one receiver.
        scales: magnitudes of E, E' and E'' that rounding is relative to (`digits`).

    Raises:
        Refused: if shapes are of another kind, or cross.

    Reference: R07 §6.2, eqs. 36-37; the second derivatives are ours.

    Example:
        >>> from firstorder.checks.agreements._edges import by_edges
        >>> from firstorder.flatland import Receiver
        >>> from firstorder.flatland.library import scene_b
        >>> E, slope, bend = by_edges(scene_b(), Receiver((0.3, 0.0), 0.0), (1.0, 1.0, 1.0))
        >>> round(E.value, 6), round(slope.value, 6)
        (0.392232, 0.942866)
    """
    spans = {k: s for k, s in enumerate(_spans(scene, at)) if s is not None}
    total, sky_error = np.zeros(3), np.zeros(3)
    for number, span in spans.items():
        if span.emission > 0.0:
            front = [spans[k] for k in _before(scene, at, spans, number)]
            both = _measure(_cosine, [*front, span])
            total += span.emission * (both - _measure(_cosine, front))
    if scene.environment is not None:
        bright = jax.tree_util.Partial(_bright, scene, at.n)
        breaks = _breaks(scene, at)
        fine, coarse = (
            -_measure(bright, list(spans.values()), n, breaks) for n in (NODES, NODES // 2)
        )
        whole = _all_sky(bright, breaks)
        total += fine + np.array([whole, 0.0, 0.0])
        sky_error = np.abs(fine - coarse)
    total += _points(scene, at)
    bounds = [rounding(100) * s + e for s, e in zip(scales, sky_error, strict=True)]
    return tuple(Found(float(v), float(b)) for v, b in zip(total, bounds, strict=True))


def _measure(T, spans: list[Span], nodes: int = NODES, breaks=()) -> np.ndarray:
    """`int over the union of T`, with two derivatives: what blockers take from full light."""
    low, high = (_stacked([getattr(s, end) for s in spans]) for end in ("low", "high"))
    return -np.asarray(_shaded(T, low, high, breaks, nodes)) + np.array(
        [_all_sky(T, breaks, nodes), 0.0, 0.0]
    )


def _all_sky(T, breaks=(), nodes: int = NODES) -> float:
    """The integral without blockers."""
    return float(_shaded(T, _stacked([]), _stacked([]), breaks, nodes)[0])


@eqx.filter_jit
def _shaded(T, low: EdgeAngle, high: EdgeAngle, breaks, nodes: int):
    """Full light less what the blockers take, with two derivatives."""
    B = shading_derivatives(
        T, jnp.zeros(1), visible_edges(low, high, others=0), nodes=nodes, breaks=breaks
    )
    return jnp.stack([B.value, B.gradient.total[0], B.hessian.total[0, 0]])


def _cosine(p, w):
    return jnp.cos(w)


def _bright(scene: Scene, n, p, w):
    return scene.sky(n + w) * jnp.cos(w)


def _breaks(scene: Scene, at: Receiver) -> list:
    """Local angles at which the sky is not smooth."""
    breaks = getattr(scene.environment, "breaks", None)
    if breaks is None:
        return []
    turned = np.mod(np.asarray(breaks) - float(at.n) + np.pi, 2.0 * np.pi) - np.pi
    return [a for a in turned if abs(a) < HORIZON]


def _stacked(edges: list[EdgeAngle]) -> EdgeAngle:
    """Edges in one array, filled up with empty ones to a power of two: few programs."""
    size = 1 << max(len(edges), 4).bit_length() - 1
    size = size if size >= len(edges) else 2 * size
    rows = [*edges, *[edge_at(0.0, 0.0, 0.0)] * (size - len(edges))]
    return jax.tree.map(lambda *leaves: jnp.asarray(np.stack(leaves)), *rows)


# --- what blocks what ----------------------------------------------------------------------------


def _spans(scene: Scene, at: Receiver):
    """The span of each shape; None for the receiver's own and for what is below the horizon."""
    if scene.crossings.pairs.shape[0]:
        raise Refused("shapes cross, and who is before whom changes in between")
    number, position = 0, np.asarray(at.position)
    emission = np.asarray(scene.material.emission)
    for group in scene.groups:
        if not isinstance(group, Segments | Circles):
            raise Refused(f"no closed form of the edges of {type(group).__name__.lower()}")
        for i in range(group.count):
            span = None
            if number != int(at.on):
                span = _span(group, i, position, at.n, emission[number])
                if span.ends[1] <= span.ends[0]:
                    span = None
            yield span
            number += 1


def _span(group, i: int, position, n, emission) -> Span:
    if isinstance(group, Segments):
        start, end = np.asarray(group.start[i]), np.asarray(group.end[i])
        # The front is on the left of start to end.
        way = end - start
        front = way[0] * (position[1] - start[1]) - way[1] * (position[0] - start[0]) > 0.0
        low, high = (
            point_edge_angle(p, position, n, side=s) for p, s in ((start, 1.0), (end, -1.0))
        )
        return Span(low, high, float(emission[0 if front else 1]))
    center, radius = group.center[i], group.radius[i]
    low, high = (circle_edge_angle(center, radius, s, position, n) for s in (1.0, -1.0))
    if not np.isfinite(float(low.value)):
        raise Refused("the receiver is inside a circle")
    return Span(low, high, float(emission[0]))


def _before(scene: Scene, at: Receiver, spans: dict[int, Span], number: int) -> list[int]:
    """The shapes that stand before one, each found by one ray in the middle of both spans."""
    found = []
    low, high = spans[number].ends
    for other, span in spans.items():
        a, b = max(low, span.ends[0]), min(high, span.ends[1])
        if other != number and b > a:
            angle = float(at.n) + 0.5 * (a + b)
            along = np.array([[-np.sin(angle), np.cos(angle)]])
            origin = np.asarray(at.position)[None]
            distances = [
                reference_nearest(_only(scene, k), origin, along)[0][0] for k in (number, other)
            ]
            if distances[1] < distances[0]:
                found.append(other)
    return found


def _only(scene: Scene, number: int) -> Scene:
    """The scene with one shape alone."""
    for group in scene.groups:
        if number < group.count:
            one = type(group)(*(leaf[number : number + 1] for leaf in _leaves(group)))
            return eqx.tree_at(lambda s: s.groups, scene, (one,))
        number -= group.count
    raise ValueError(f"Argument `number` must be that of a shape, but is {number}.")


def _leaves(group) -> tuple:
    if isinstance(group, Segments):
        return group.start, group.end
    return group.center, group.radius


def _points(scene: Scene, at: Receiver) -> np.ndarray:
    """`I y / r^2` with `y` up and `x` across, and its derivatives as x falls."""
    total = np.zeros(3)
    position = np.asarray(at.position)
    c, s = np.cos(float(at.n)), np.sin(float(at.n))
    for place, power in zip(
        np.asarray(scene.points.position), np.asarray(scene.points.intensity), strict=True
    ):
        way = place - position
        x, y = c * way[0] + s * way[1], c * way[1] - s * way[0]
        r = np.hypot(x, y)
        t, _ = reference_nearest(scene, position[None], (way / r)[None], int(at.on))
        if y > 0.0 and t[0] >= r:
            bend = 8.0 * x**2 * y / r**6 - 2.0 * y / r**4
            total += power * np.array([y / r**2, 2.0 * x * y / r**4, bend])
    return total
