"""Irradiance to 50 digits, and its derivatives by differences: a reference that shares no code.

Shapes are read as decimal numbers and asked textbook questions, one ray and one equation at a time:
events are the angles of ends and of points of tangency, and between two of them one ray finds what
is seen. With 50 digits a central difference of step 1e-12 times the scene's size has an error of
some 24 digits less than its value: nothing beside double precision.

It also says how far the receiver may move until another pair of edges meets in one line
(`reach`), where derivatives jump, and how ill-conditioned each derivative is (`scales`).
"""

from __future__ import annotations

import dataclasses
import itertools
from typing import Any, NamedTuple

import mpmath as mp
import numpy as np

from firstorder.errors import Refused
from firstorder.flatland.scene import Scene
from firstorder.flatland.shapes.kinds import Arcs, Circles, Ellipses, Segments
from firstorder.flatland.skies import ConstantSky, GaussianSky
from firstorder.flatland.visible import Receiver

DIGITS = 50
STEP = mp.mpf(10) ** -12  # of the differences, in units of the nearest edge's distance
BESIDE = mp.mpf(10) ** -4  # how far from the ends of a gap what is seen is asked again

# A point, or a direction, of the receiver's frame: (across, up).
Pair = tuple[Any, Any]


class Curve(NamedTuple):
    """A shape in the receiver's frame.

    Attributes:
        kind: "segment" or "conic".
        data: of a segment its ends; of a conic its centre, the two axes (vectors) whose ends are
            where it lies at the angles 0 and pi/2, and the swept interval of angles, or None.
        emission: of front and back [W/(m rad)].
    """

    kind: str
    data: tuple
    emission: Pair


class Event(NamedTuple):
    """A direction in which what is seen may change.

    Attributes:
        angle: local, counter-clockwise from the normal [rad].
        name: shape and which of its silhouettes.
        distance: to the point [m].
        radius: of curvature of the shape there, 0 for an end [m].
    """

    angle: Any
    name: tuple
    distance: Any
    radius: Any


class Seen(NamedTuple):
    """Irradiance at a receiver, and the gaps that it sees.

    Attributes:
        value: irradiance.
        pattern: the names of shapes and events from -pi/2 to pi/2, where light changes; two
            receivers with one pattern have no visual event between them, as far as light goes.
        scales: sums of the magnitudes of what E, E' and E'' are added up from.
        nearest: distance of the nearest event or light [m].
        shadows: whether an edge that is not a light's own bounds it.
    """

    value: Any
    pattern: tuple
    scales: tuple
    nearest: Any
    shadows: bool


@dataclasses.dataclass(frozen=True)
class Digits:
    """Irradiance at a receiver with two derivatives along its tangent, to many digits.

    Attributes:
        value, first, second: rounded to double precision.
        scales: for each, the magnitude that its rounding errors are relative to.
        reach: how far the receiver may move both ways with the same pattern of edges; 0 where two
            edges are in line here [m].
        edges: how many edges of light are seen.
        shadows: whether some light is partly hidden, so that a shadow's edge lies on it.
    """

    value: float
    first: float
    second: float
    scales: tuple[float, float, float]
    reach: float
    edges: int
    shadows: bool


def digits(scene: Scene, at: Receiver, most: float = 0.05) -> Digits:
    """E, E' and E'' at a receiver to double precision, by 50-digit arithmetic.

    Valid when: the scene has segments, circles, ellipses and arcs, and a sky that is constant or
    Gaussian, or none. At a visual event (`reach` 0) only the value means something.

    Args:
        scene: concrete shapes and lights.
        at: one receiver; not on a shape that it sees itself.
        most: the largest reach that is looked for [m].

    Raises:
        Refused: if the scene holds something that has no closed form here.

    Example:
        >>> from firstorder.checks.agreements._digits import digits
        >>> from firstorder.flatland import Receiver
        >>> from firstorder.flatland.library import scene_a
        >>> found = digits(scene_a(), Receiver((0.5, 0.0), 0.0))
        >>> f"{found.value:.15f} {found.first:.15f}"
        '0.707106781186548 -0.646446609406726'
    """
    with mp.workdps(DIGITS):
        world = _world(scene, at)
        here = _seen(world, mp.mpf(0))
        h = STEP * min(here.nearest, 1)
        right, left = _seen(world, h), _seen(world, -h)
        first = (right.value - left.value) / (2 * h)
        second = (right.value - 2 * here.value + left.value) / h**2
        same = right.pattern == left.pattern == here.pattern
        reach = _reach(world, here, mp.mpf(most)) if same else mp.mpf(0)
        numbers = (float(x) for x in (here.value, first, second))
        scales = tuple(float(s) for s in here.scales)
        return Digits(*numbers, scales, float(reach), len(here.pattern), here.shadows)


def shifted(scene: Scene, at: Receiver, steps) -> list[float]:
    """E at receivers moved along the tangent, to double precision, by the same arithmetic."""
    with mp.workdps(DIGITS):
        world = _world(scene, at)
        return [float(_seen(world, mp.mpf(float(x))).value) for x in steps]


def _reach(world, here: Seen, most):
    """The largest of most, most/2, ... at which several receivers see the same pattern."""
    for _ in range(24):
        if all(
            _seen(world, share * most).pattern == here.pattern
            for share in (mp.mpf(-1), mp.mpf(-0.5), mp.mpf(0.5), mp.mpf(1))
        ):
            return most
        most /= 2
    return mp.mpf(0)


# --- the scene in the receiver's frame -----------------------------------------------------------


class _World(NamedTuple):
    curves: list[Curve]
    points: list[tuple[Pair, Any]]
    sky: Any
    n: Any
    on: int


def _world(scene: Scene, at: Receiver) -> _World:
    """All shapes as decimal numbers in the frame (tangent, normal) at the receiver."""
    n, on = mp.mpf(float(at.n)), int(at.on)
    c, s = mp.cos(n), mp.sin(n)
    origin = _vector(at.position)

    def turned(v):
        return (c * v[0] + s * v[1], c * v[1] - s * v[0])

    def placed(p):
        return turned(_minus(p, origin))

    curves: list[Curve] = []
    emission = np.asarray(scene.material.emission, float)
    for group in scene.groups:
        for i in range(group.count):
            shines = tuple(mp.mpf(float(e)) for e in emission[len(curves)])
            kind, data = _curve(group, i, placed, turned)
            if len(curves) == on and isinstance(group, Arcs):
                raise Refused("the receiver lies on an arc, which it may see itself")
            curves.append(Curve(kind, data, shines))
    positions = np.asarray(scene.points.position, float)
    powers = np.asarray(scene.points.intensity, float)
    points = [
        (placed(_vector(p)), mp.mpf(float(q))) for p, q in zip(positions, powers, strict=True)
    ]
    if not isinstance(scene.environment, ConstantSky | GaussianSky | None):
        raise Refused(f"no closed form in 50 digits for a sky of {_kind(scene.environment)}")
    return _World(curves, points, scene.environment, n, on)


def _curve(group, i: int, placed, turned) -> tuple[str, tuple]:
    match group:
        case Segments():
            return "segment", (placed(_vector(group.start[i])), placed(_vector(group.end[i])))
        case Circles() | Arcs():
            r = mp.mpf(float(group.radius[i]))
            span = None
            if isinstance(group, Arcs):
                start, sweep = mp.mpf(float(group.start[i])), mp.mpf(float(group.sweep[i]))
                span = (start, sweep)
            # At angle 0 the top, at pi/2 the left: counter-clockwise from +y.
            axes = turned((mp.mpf(0), r)), turned((-r, mp.mpf(0)))
            return "conic", (placed(_vector(group.center[i])), *axes, span)
        case Ellipses():
            a, b = _vector(group.semi[i])
            tilt = mp.mpf(float(group.tilt[i]))
            c, s = mp.cos(tilt), mp.sin(tilt)
            axes = turned((-s * b, c * b)), turned((-c * a, -s * a))
            return "conic", (placed(_vector(group.center[i])), *axes, None)
    raise Refused(f"no equations in 50 digits for {_kind(group)}")


# --- what is seen --------------------------------------------------------------------------------


def _seen(world: _World, x) -> Seen:
    """Irradiance of a receiver moved by x along its tangent, as a sum over gaps."""
    origin = (x, mp.mpf(0))
    value, scales, pattern, shadows = mp.mpf(0), [mp.mpf(0)] * 3, [], False
    before, L0 = -1, mp.mpf(0)  # the shape in the gap before, and its light
    for a, b, number, front in _gaps(world, origin):
        L, wide = _emitted(world, number, front), mp.sin(b.angle) - mp.sin(a.angle)
        value += L * wide
        if number < 0 and world.sky is not None:
            value += _sky(world, a.angle, b.angle)
            L = mp.mpf(float(np.asarray(world.sky.radiance)))
        scales[0] += L * wide
        if L != L0:
            jump, r = max(L, L0), a.distance
            scales[1] += jump / r
            scales[2] += jump * (4 / r**2 + a.radius / r**3)
            pattern.append((a.name, number if L else None))
            if a.name[0] != "horizon":
                shadows |= bool(L) and a.name[0] != number
                shadows |= bool(L0) and a.name[0] != before
        L0, before = L, number
    nearest = min([e.distance for e in _inside(world, origin)] or [mp.mpf(1)])
    for k, (p, power) in enumerate(world.points):
        w = _minus(p, origin)
        r = mp.hypot(*w)
        if r == 0:
            raise ValueError("Argument `at` must lie beside all point lights, but is at one.")
        nearest = min(nearest, r)
        if w[1] > 0 and not _hidden(world, origin, w):
            value += power * w[1] / r**2
            scales = [s + power * (1, 2, 6)[j] / r ** (j + 1) for j, s in enumerate(scales)]
            pattern.append(("point", k))
    return Seen(value, tuple(pattern), tuple(scales), nearest, shadows)


def _inside(world, origin) -> list[Event]:
    """All events above the horizon."""
    found = (_events(k, c, origin) for k, c in enumerate(world.curves) if k != world.on)
    return [e for events in found for e in events if abs(e.angle) < mp.pi / 2]


def _gaps(world, origin):
    """Neighbouring events and the shape seen between them, those that hide nothing left out."""
    ends = [Event(s * mp.pi / 2, ("horizon", s), mp.inf, 0) for s in (-1, 1)]
    ordered = sorted([*ends, *_inside(world, origin)], key=lambda e: e.angle)
    merged: list[tuple] = []
    for a, b in itertools.pairwise(ordered):
        for gap in _parted(world, origin, a, b) if b.angle > a.angle else ():
            if merged and merged[-1][2:] == gap[2:]:
                gap = (merged.pop()[0], *gap[1:])
            merged.append(gap)
    return merged


def _parted(world, origin, a: Event, b: Event):
    """The gap, or its parts where two shapes cross in it and take turns in being nearest."""
    wide = b.angle - a.angle
    low, high = a.angle + BESIDE * wide, b.angle - BESIDE * wide
    first, middle, last = (_nearest(world, origin, t) for t in (low, (a.angle + b.angle) / 2, high))
    if first == middle == last:
        return [(a, b, *middle)]
    for _ in range(int(3.4 * DIGITS)):
        t = (low + high) / 2
        low, high = (t, high) if _nearest(world, origin, t) == first else (low, t)
    t = (low + high) / 2
    along = (-mp.sin(t), mp.cos(t))
    hits = [d for d, _ in _hits(world.curves[first[0]], origin, along)] if first[0] >= 0 else []
    cut = Event(t, ("crossing", first[0], last[0]), min(hits, default=mp.inf), 0)
    return [(a, cut, *first), (cut, b, *last)]


def _nearest(world, origin, angle) -> tuple[int, bool]:
    """Number of the first shape in a direction, -1 for none, and whether its front is seen."""
    along = (-mp.sin(angle), mp.cos(angle))
    best, found = mp.inf, (-1, True)
    for number, curve in enumerate(world.curves):
        if number != world.on:
            for t, front in _hits(curve, origin, along):
                if 0 < t < best:
                    best, found = t, (number, front)
    return found


def _hidden(world, origin, way: Pair) -> bool:
    """Whether a shape stands between the receiver and a point light."""
    return any(
        0 < t < 1
        for number, curve in enumerate(world.curves)
        if number != world.on
        for t, _ in _hits(curve, origin, way)
    )


def _emitted(world, number: int, front: bool):
    return world.curves[number].emission[0 if front else 1] if number >= 0 else mp.mpf(0)


def _sky(world, a, b):
    """`int L(n + t) cos(t) dt`: of a Gaussian, error functions of complex numbers."""
    sky = world.sky
    if isinstance(sky, ConstantSky):
        return mp.mpf(float(sky.radiance)) * (mp.sin(b) - mp.sin(a))
    L, sigma = mp.mpf(float(sky.radiance)), mp.mpf(float(sky.sigma))
    middle, total = mp.mpf(float(sky.center)) - world.n, mp.mpf(0)
    middle -= 2 * mp.pi * mp.nint(middle / (2 * mp.pi))
    for k in range(-2, 3):
        c = middle + 2 * mp.pi * k
        ends = [mp.erf((t - c - 1j * sigma**2) / (sigma * mp.sqrt(2))) for t in (a, b)]
        front = mp.exp(1j * c - sigma**2 / 2) * sigma * mp.sqrt(mp.pi / 2)
        total += (front * (ends[1] - ends[0])).real
    return L * total


# --- one shape -----------------------------------------------------------------------------------


def _events(number: int, curve: Curve, origin: Pair):
    """Ends and points of tangency of a shape."""
    if curve.kind == "segment":
        for which, p in enumerate(curve.data):
            yield _event(number, which, _minus(p, origin), mp.mpf(0))
        return
    center, top, left, span = curve.data
    w = _minus(origin, center)
    # The receiver in the frame in which the conic is the unit circle: w = p top + q left.
    det = _cross(top, left)
    p, q = _cross(w, left) / det, _cross(top, w) / det
    square = p * p + q * q
    if square > 1:
        foot, side = 1 / square, mp.sqrt(square - 1) / square
        for which, sign in enumerate((1, -1)):
            u = foot * p - sign * side * q, foot * q + sign * side * p
            if span is None or _swept(mp.atan2(u[1], u[0]), span):
                v = (u[0] * left[0] - u[1] * top[0], u[0] * left[1] - u[1] * top[1])
                radius = mp.hypot(*v) ** 3 / abs(det)
                at = _along(center, top, left, u)
                yield _event(number, which, _minus(at, origin), radius)
    if span is not None:
        for which, angle in enumerate((span[0], span[0] + span[1])):
            u = mp.cos(angle), mp.sin(angle)
            at = _along(center, top, left, u)
            yield _event(number, 2 + which, _minus(at, origin), mp.mpf(0))


def _event(number: int, which: int, w: Pair, radius) -> Event:
    return Event(mp.atan2(-w[0], w[1]), (number, which), mp.hypot(*w), radius)


def _hits(curve: Curve, origin: Pair, along: Pair):
    """Where a line meets a shape, in units of `along`, and whether from the front."""
    if curve.kind == "segment":
        a, b = curve.data
        edge = _minus(b, a)
        det = _cross(along, edge)
        if det != 0:
            w = _minus(a, origin)
            if 0 <= _cross(w, along) / det <= 1:
                # The normal is to the left of the edge: its front is seen against it.
                yield _cross(w, edge) / det, _cross(edge, along) < 0
        return
    center, top, left, span = curve.data
    det = _cross(top, left)
    w = _minus(origin, center)
    wp, wq = _cross(w, left) / det, _cross(top, w) / det
    dp, dq = _cross(along, left) / det, _cross(top, along) / det
    A, B, C = dp * dp + dq * dq, wp * dp + wq * dq, wp * wp + wq * wq - 1
    root = B * B - A * C
    if root <= 0:
        return
    for sign in (-1, 1):
        t = (-B + sign * mp.sqrt(root)) / A
        u = wp + t * dp, wq + t * dq
        if span is None or _swept(mp.atan2(u[1], u[0]), span):
            outward = u[0] * dp + u[1] * dq < 0  # whether it is met from outside
            # Closed shapes travel clockwise; an arc as its sweep says, normal to the left.
            yield t, outward if span is None or span[1] < 0 else not outward


def _swept(angle, span) -> bool:
    start, sweep = span
    turned = (angle - start) * mp.sign(sweep)
    return turned - 2 * mp.pi * mp.floor(turned / (2 * mp.pi)) <= abs(sweep)


def _along(center, top, left, u) -> Pair:
    return (
        center[0] + u[0] * top[0] + u[1] * left[0],
        center[1] + u[0] * top[1] + u[1] * left[1],
    )


def _minus(a: Pair, b: Pair) -> Pair:
    return a[0] - b[0], a[1] - b[1]


def _cross(a: Pair, b: Pair):
    return a[0] * b[1] - a[1] * b[0]


def _vector(p) -> Pair:
    x, y = np.asarray(p, float)
    return mp.mpf(x), mp.mpf(y)


def _kind(thing) -> str:
    return f"kind {type(thing).__name__}"
