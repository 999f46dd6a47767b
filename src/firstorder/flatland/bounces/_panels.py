"""Surfaces cut into panels on which irradiance is smooth, each with Gauss-Legendre nodes.

Irradiance on a surface is analytic between visual events, so the cuts are there; a panel is also
no longer than its distance to other surfaces, which grades the panels towards corners, where the
solution has powers that are not whole (`derivations.flatland.bounces.radiosity`), and keeps the
kernel's poles at a distance of the order of the panel.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from firstorder._argument_checks import (
    check_count,
    check_integer,
    check_not_negative,
    check_positive,
)
from firstorder._display import Module
from firstorder.conventions import direction
from firstorder.flatland.discontinuities._critical_lines import (
    crossing_places,
    open_shapes,
    parameter,
    positions,
    singles,
)
from firstorder.flatland.discontinuities.events import VisualEvents, visual_events
from firstorder.flatland.intersect import nearest
from firstorder.flatland.scene import Scene
from firstorder.flatland.shapes._base import own_unit
from firstorder.flatland.shapes.kinds import Segments
from firstorder.numerics._quadrature import gauss_legendre
from firstorder.scene._bands import merged_bands

GRADING = 0.35  # a panel beside a corner is cut here, seen from the corner
CLOSE = 1.2  # longest panel, in distances to the nearest surface it does not touch
TURN = 0.9  # longest panel on a curve, in radians that the normal turns
TOUCHING = 1e-9  # shapes that are nearer than this share of their size touch
SHORTEST = 4.0  # panel, in steps in which the ends of what is seen are told apart
MOST = 20_000  # nodes, each of which gathers from all others: 3.2 GB


@dataclasses.dataclass(frozen=True)
class Discretization:
    """Fineness of the panels into which surfaces are cut.

    Attributes:
        nodes: on each panel.
        smallest: of a panel beside a corner, or in a gap between two shapes, over the size of its
            shape; in single precision no panel is shorter than some thousandths of that.
        halvings: every panel is halved so many times.

    Raises:
        ValueError: if `nodes` or `halvings` is no integer, or a number is out of its range.

    Example:
        >>> from firstorder.flatland.bounces import Discretization
        >>> Discretization().finer().nodes
        10
    """

    nodes: int = 8
    smallest: float = 1e-6
    halvings: int = 0

    def __post_init__(self):
        """Refuse numbers with which no panel can be made."""
        check_count("nodes", self.nodes)
        check_positive("smallest", self.smallest)
        check_integer("halvings", self.halvings)
        check_not_negative("halvings", self.halvings)

    def finer(self) -> Discretization:
        """One refinement: two more nodes, corners a hundred times finer."""
        return Discretization(self.nodes + 2, 0.01 * self.smallest, self.halvings)


def resolution(dtype: jnp.dtype) -> float:
    """The step in a parameter below which the end of what is seen and that of a panel are one."""
    return min(1e5 * float(jnp.finfo(dtype).eps), 1e-3)


def _touching_share(scene: Scene) -> float:
    """`TOUCHING`, or what rounding makes of the common end of two shapes."""
    return max(TOUCHING, 16.0 * float(jnp.finfo(scene.material.emission.dtype).eps))


class Panels(Module):
    """Panels in order of shape, side and parameter.

    Attributes:
        shape, side: of each panel; side 0 is the front.
        ends: first and last parameter.
        count: nodes on each panel.
    """

    shape: Int[Array, " p"]
    side: Int[Array, " p"]
    ends: Float[Array, "p 2"]
    count: int = eqx.field(static=True)

    def rule(self) -> tuple[Float[Array, "p k"], Float[Array, "p k"]]:
        """Parameters of the nodes, and their weights in the parameter."""
        t, w = (jnp.asarray(a, self.ends.dtype) for a in gauss_legendre(self.count))
        middle, half = (
            self.ends.mean(1)[:, None],
            0.5 * (self.ends[:, 1] - self.ends[:, 0])[:, None],
        )
        return middle + half * t, half * w

    def basis(
        self, panel: Int[Array, ""], s: Float[Array, ""]
    ) -> tuple[Float[Array, " k"], Float[Array, " k"]]:
        """The Lagrange polynomials of a panel's nodes at s, and their derivatives in s."""
        a, b = self.ends[panel, 0], self.ends[panel, 1]
        scale = 2.0 / (b - a)
        value, slope = legendre(self.count, scale * (s - a) - 1.0)
        inverse = jnp.asarray(to_legendre(self.count), self.ends.dtype)
        return value @ inverse, scale * (slope @ inverse)

    def holding(
        self, sheet: Int[Array, "*n"], s: Float[Array, "*n"]
    ) -> tuple[Int[Array, "*n"], Bool[Array, "*n"]]:
        """The panel that holds a parameter of a sheet (twice the shape plus the side), if any."""
        sheets = 2 * self.shape + self.side
        k = jnp.searchsorted(2.0 * sheets + self.ends[:, 0], 2.0 * sheet + s, side="right") - 1
        k = jnp.clip(k, 0, self.shape.shape[0] - 1)
        return k, sheets[k] == sheet


def legendre(count: int, t: Array) -> tuple[Array, Array]:
    """The first `count` Legendre polynomials and their derivatives at t, along a new last axis."""
    p, d = [jnp.ones_like(t), t], [jnp.zeros_like(t), jnp.ones_like(t)]
    for n in range(1, count - 1):
        p.append(((2 * n + 1) * t * p[n] - n * p[n - 1]) / (n + 1))
        d.append(d[n - 1] + (2 * n + 1) * p[n])
    return jnp.stack(p[:count], -1), jnp.stack(d[:count], -1)


@functools.cache
def to_legendre(count: int) -> np.ndarray:
    """The matrix from values at the nodes to coefficients of Legendre polynomials."""
    t, w = gauss_legendre(count)
    P = np.stack([np.polynomial.legendre.legval(t, np.eye(count)[n]) for n in range(count)])
    return (np.arange(count) + 0.5)[:, None] * P * w


def cut_into_panels(
    scene: Scene, fineness: Discretization | None = None
) -> tuple[Panels, VisualEvents]:
    """Panels for all surfaces that light can reach, and the events at which they are cut.

    Args:
        scene: concrete shapes and lights.
        fineness: see there.

    Returns:
        The panels, and the visual events.
    """
    fineness = fineness or Discretization()
    scene = merged_bands(scene)
    lit = visual_events(scene)
    # Shadow edges of point lights, and kinks of their light on curves: events make more events.
    lit = lit.take(np.isin(lit.kind, ("shadow", "dusk")))
    breaks = tuple(zip(lit.receiver.tolist(), lit.s.tolist(), strict=True))
    events = visual_events(scene, breaks=breaks)
    touches = _touching(scene)
    shape, side, ends = [], [], []
    for i, j in reached_sides(scene) or [(0, 0)]:  # a dark scene has one dark panel
        here = (events.receiver == i) & (events.front == (j == 0))
        inner = [*events.s[here], *(s for k, s in touches if k == i)]
        most = MOST // fineness.nodes - len(shape)
        pieces = _pieces(scene, i, np.array(inner), fineness, most)
        shape += [i] * len(pieces)
        side += [j] * len(pieces)
        ends += pieces
    return Panels(
        jnp.asarray(np.array(shape, dtype=np.int32)),
        jnp.asarray(np.array(side, dtype=np.int32)),
        jnp.asarray(np.array(ends)),
        fineness.nodes,
    ), events


# --- which surfaces ------------------------------------------------------------------------------


def reached_sides(scene: Scene, points: int = 24, rays: int = 96) -> list[tuple[int, int]]:
    """Sides of shapes that light can reach, by way of any others: (shape, side), in order.

    Sides look at each other along a fan of rays from each of a few points; a side that is lit only
    through a slit narrower than the fan's step is missed.
    """
    sheets = list(itertools.product(range(scene.count), (0, 1)))
    sees = np.asarray(_fans(scene, points, rays))  # (shapes, 2, n): a sheet, or -1
    n, void = len(sheets), 2 * scene.count
    sees = np.where(sees.reshape(n, -1) < 0, void, sees.reshape(n, -1))
    linked = np.zeros((n, n + 1), bool)
    for i in range(n):
        linked[i, sees[i]] = True
    linked[:, :n] |= linked[:, :n].T
    glows = np.asarray(scene.material.emission).ravel() > 0.0
    lit = glows | (linked[:, void] & (scene.environment is not None))
    for place in np.asarray(scene.points.position):
        angles = 2.0 * np.pi * (np.arange(16 * rays) + 0.5) / (16 * rays)
        seen = np.asarray(_fan(scene, jnp.asarray(place), jnp.asarray(angles)))
        lit[seen[seen >= 0]] = True
    while True:
        more = lit | np.any(linked[:, :n] & lit[None, :], axis=1)
        if np.array_equal(more, lit):
            return [sheets[k] for k in np.flatnonzero(lit)]
        lit = more


def _sheets(scene, origins, along, on):
    hits = nearest(scene, origins, along, on)
    frames = jax.vmap(scene.frame)(jnp.maximum(hits.index, 0), hits.s)
    side = (jnp.sum(frames.normal * along, -1) > 0.0).astype(int)
    return jnp.where(hits.index >= 0, 2 * hits.index + side, -1)


@eqx.filter_jit
def _fan(scene, place, angles):
    along = direction(angles)
    return _sheets(scene, jnp.broadcast_to(place, along.shape), along, -1)


@eqx.filter_jit
def _fans(scene, points, rays):
    s = (jnp.arange(points) + 0.5) / points
    theta = jnp.pi * ((jnp.arange(rays) + 0.5) / rays - 0.5)

    def one(index, s, side):
        frame = scene.frame(index, s)
        a = frame.n + side * jnp.pi + theta
        along = direction(a)
        return _sheets(scene, jnp.broadcast_to(frame.position, along.shape), along, index)

    def sheet(k):
        return jax.vmap(lambda t: one(k // 2, t, k % 2))(s)

    return jax.lax.map(sheet, jnp.arange(2 * scene.count))


# --- where to cut --------------------------------------------------------------------------------


def _touching(scene: Scene) -> list[tuple[int, float]]:
    """Contacts and crossings of shapes: (shape, parameter) on both."""
    found = [place for both in crossing_places(scene) for place in both]
    shapes, size = singles(scene), _touching_share(scene) * float(own_unit(scene.groups))
    for i in open_shapes(scene):
        for end in (0.0, 1.0):
            place = positions(scene, [i], [end])[0]
            for j in range(scene.count):
                if j == i:
                    continue
                s = _nearest(scene, shapes, j, place)
                if np.linalg.norm(positions(scene, [j], [s])[0] - place) < size:
                    found += [(i, end), (j, s)]
    return found


def _nearest(scene, shapes, j, place) -> float:
    """Parameter of the point of a shape that is nearest to a place."""
    if isinstance(shapes[j], Segments):
        a, edge = np.asarray(shapes[j].start), np.asarray(shapes[j].end - shapes[j].start)
        return float(np.clip((place - a) @ edge / (edge @ edge), 0.0, 1.0))
    return float(np.clip(parameter(scene, j, place), 0.0, 1.0))


def _pieces(
    scene: Scene, i: int, inner, fineness: Discretization, most: int
) -> list[tuple[float, float]]:
    """The panels of one side of one shape; an error if they are more than `most`."""
    knots = np.unique(np.concatenate([[0.0, 1.0], np.clip(inner, 0.0, 1.0)]))
    finest = resolution(scene.material.emission.dtype)
    knots = knots[np.concatenate([[True], np.diff(knots) > max(1e-10, finest)])]
    knots[-1] = 1.0
    length = float(_length(scene, jnp.asarray(i)))
    near = _distance_to_others(scene, i)
    bend = _turning(scene, i)
    out: list[tuple[float, float]] = []
    todo = list(itertools.pairwise(knots))[::-1]
    while todo:
        a, b = todo.pop()
        if (len(out) + len(todo)) << fineness.halvings >= most:
            raise ValueError(
                f"Argument `fineness` must leave at most {MOST} nodes on all surfaces of the scene,"
                f" but shape {i} takes them beyond: take fewer `nodes` or a larger `smallest`."
            )
        touching = _touching_share(scene) * length
        apart = near(np.linspace(a, b, 7))
        # A shape along which the panel lies, such as a box on a floor, has no light for it.
        here = np.min(apart[np.any(apart > touching, 1)], 0, initial=np.inf)
        first, last = here[0] <= touching, here[-1] <= touching
        gap = float(here.min())
        ratio = (1.0 - GRADING) / GRADING * (1.0 + 1e-6) if near.touches else CLOSE
        small = (b - a) <= max(fineness.smallest, SHORTEST * finest)
        fits = (b - a) * length <= ratio * gap and (b - a) * bend <= TURN
        if fits or small:
            out.append((a, b))
            continue
        split = 0.5 if first == last else (GRADING if first else 1.0 - GRADING)
        middle = a + split * (b - a)
        todo += [(middle, b), (a, middle)]
    for _ in range(fineness.halvings):
        out = [half for a, b in out for half in ((a, 0.5 * (a + b)), (0.5 * (a + b), b))]
    return out


class _Distance:
    """Distances of points of a shape to each other shape."""

    def __init__(self, scene: Scene, i: int):
        self.scene, self.i = scene, i
        self.segments, self.clouds = [], []
        for j, shape in enumerate(singles(scene)):
            if j == i:
                continue
            if isinstance(shape, Segments):
                self.segments.append((np.asarray(shape.start), np.asarray(shape.end)))
            else:
                s = np.linspace(0.0, 1.0, 257)
                self.clouds.append(positions(scene, np.full(len(s), j), s))
        length = float(_length(scene, jnp.asarray(i)))
        touching = _touching_share(scene) * length
        self.touches = bool(np.any(self(np.array([0.0, 1.0])) < touching))

    def __call__(self, s: np.ndarray) -> np.ndarray:
        """Shape (other shapes, points) [m]."""
        p = positions(self.scene, np.full(len(s), self.i), s)
        found = [np.zeros((0, len(s)))]
        for a, b in self.segments:
            e = b - a
            t = np.clip((p - a) @ e / (e @ e), 0.0, 1.0)
            found.append(np.linalg.norm(a + t[:, None] * e - p, axis=1)[None])
        for cloud in self.clouds:
            found.append(np.linalg.norm(cloud[None] - p[:, None], axis=-1).min(axis=1)[None])
        return np.concatenate(found)


def _distance_to_others(scene: Scene, i: int) -> _Distance:
    return _Distance(scene, i)


def _turning(scene: Scene, i: int) -> float:
    """Fastest turn of the normal in the parameter [rad]."""
    frames = _frames_along(scene, jnp.asarray(i), jnp.linspace(0.0, 1.0, 65))
    return float(jnp.max(jnp.abs(frames.kappa * frames.speed)))


@eqx.filter_jit
def _length(scene, i):
    t, w = (jnp.asarray(a, scene.material.emission.dtype) for a in gauss_legendre(64))
    speed = jax.vmap(lambda s: scene.frame(i, s).speed)(0.5 + 0.5 * t)
    return jnp.sum(0.5 * w * speed)


@eqx.filter_jit
def _frames_along(scene, i, s):
    return jax.vmap(lambda t: scene.frame(i, t))(s)
