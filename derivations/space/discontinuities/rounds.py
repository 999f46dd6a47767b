"""Visual events of round bodies: how their outlines move for an eye, and what it is to touch one.

Corollaries of our own. Let a body be `x = c + A y, |y| <= 1`, with `S = A A^T`; a disc has a matrix
of rank two. After a turn of space and one of the y an outline passes along u where

    A = (a b c; 0 d e; 0 0 f),    u along A e_1,    the point that is seen: c + A e_3,

for any A is an upper triangle after such turns, e_3 is the point y that is seen, and e_1 the
direction along which the line of sight touches the ball of the y. An eye is r behind that point.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import sympy as sp

from derivations.space.discontinuities.events import (
    REACH,
    START,
    WAY,
    clipped,
    corners,
    derivatives_on_line,
    lambert,
    pyramid,
)
from firstorder.ledger import Check, Row, na

a, d, f, r = sp.symbols("a d f r", positive=True)
b, c, e = sp.symbols("b c e", real=True)
A = sp.Matrix([[a, b, c], [0, d, e], [0, 0, f]])
S = A * A.T
u = sp.Matrix([1, 0, 0])
w = r * u - A[:, 2]  # from the eye to the middle of the body


def form(way, to_middle=w):
    """F, zero along outlines."""
    side = to_middle.cross(way)
    return (side.T * S * side)[0] - (way.T * S.adjugate() * way)[0]


def outline():
    """The line of sight is on the outline, and the outline's normal there is that of the body."""
    v = sp.Matrix(sp.symbols("v_1:4", real=True))
    slope = sp.Matrix([sp.diff(form(v), x) for x in v]).subs(dict(zip(v, u, strict=True)))
    return [sp.expand(form(u)), *map(sp.expand, slope[:2])]


def image_of_a_limb():
    """A limb moves with `-(d . m) / r`, as an edge does: r is to the point that is seen."""
    h = sp.Symbol("h", real=True)
    found = []
    for step in (sp.Matrix([1, 0, 0]), sp.Matrix([0, 1, 0]), sp.Matrix([0, 0, 1])):
        rate = sp.Symbol("q", real=True)
        moved = form(u + h * rate * sp.Matrix([0, 0, 1]), w - h * step)
        (height,) = sp.solve(sp.diff(moved, h).subs(h, 0), rate)
        found.append(sp.cancel(height + step[2] / r))
    return found


def plane():
    """Planes with the normal n touch if `n S n = (n . w)^2`, `w - S n / (n . w)` from the eye."""
    n = sp.Matrix([0, 0, 1])  # of the body's surface at A e_3: A^-T e_3 is along it
    touch = w - S * n / n.dot(w)
    return [sp.expand((n.T * S * n)[0] - n.dot(w) ** 2), *(touch - r * u).applyfunc(sp.simplify)]


def adjugate():
    """`u adj(S - w w) u` is `-F`: the cone of a body and its planes are each other's duals."""
    q, z = (sp.Matrix(sp.symbols(f"{name}_1:4", real=True)) for name in "qz")
    M = sp.Matrix(3, 3, lambda i, j: sp.Symbol(f"S_{min(i, j)}{max(i, j)}", real=True))
    side = z.cross(q)
    told = (side.T * M * side)[0] - (q.T * M.adjugate() * q)[0]
    return sp.expand((q.T * (M - z * z.T).adjugate() * q)[0] + told)


def curvature():
    """Of `F = 0` about u, on the plane `u + x tau + y m`: `k = -tau F tau / |F u|`."""
    x, k = sp.symbols("x k", real=True)
    curve = form(u + x * sp.Matrix([0, 1, 0]) + k * x**2 / 2 * sp.Matrix([0, 0, 1]))
    (bend,) = sp.solve(sp.diff(curve, x, 2).subs(x, 0), k)
    tau = sp.Matrix([0, 1, 0])
    slope = sp.diff(form(u + x * sp.Matrix([0, 0, 1])), x).subs(x, 0) / 2
    return sp.cancel(bend + form(tau) / slope)


def lens():
    """Two outlines with `y_1 - y_2 = k x^2 / 2 - s`: the lens between, and E'' at the distance x.

    With `s = g x`, and E'' as the second derivative of the light `K` in the lens.
    """
    k, s, g, t, x, K = sp.symbols("k s g t x K", positive=True)
    area = sp.integrate(s - k * t**2 / 2, (t, -sp.sqrt(2 * s / k), sp.sqrt(2 * s / k)))
    told = 4 * sp.sqrt(2) / 3 * s ** sp.Rational(3, 2) / sp.sqrt(k)
    second = sp.diff(K * told.subs(s, g * x), x, 2)
    root = K * sp.sqrt(2 / k) * g ** sp.Rational(3, 2) / sp.sqrt(x)
    return sp.simplify(area - told), sp.simplify(second - root)


def hull():
    """The hull of `y < -k_1 x^2 / 2` and `y < s - k_2 x^2 / 2`, k_1 < k_2, less the first of them.

    A line of the slope -q touches both, at q / k_1 and q / k_2. The area over that of the lens.
    """
    k1, more, s, x = sp.symbols("k_1 k s x", positive=True)
    k2 = k1 + more
    q = sp.sqrt(2 * s * k1 * k2 / more)
    gap = (k1 * x**2 - q * 2 * x) / 2 + q**2 / (2 * k1)  # from the first to the line
    over_second = sp.integrate(s - more * x**2 / 2, (x, 0, q / k2))
    area = 2 * (over_second + sp.integrate(sp.expand(gap), (x, q / k2, q / k1)))
    told = 4 * sp.sqrt(2) / 3 * s ** sp.Rational(3, 2) / sp.sqrt(more)
    told = told * (k1 + k2) / (2 * sp.sqrt(k1 * k2))
    above_second = q**2 / (2 * k1) - q * x - (s - k2 * x**2 / 2)
    return sp.simplify(area / told - 1), sp.simplify(above_second.subs(x, q / k2))


def wall():
    """F of a body whose last half-axis is endless, over the square of its length."""
    L = sp.Symbol("L", positive=True)
    stretched = sp.Matrix.hstack(A[:, 0], A[:, 1], L * A[:, 2])
    spread = stretched * stretched.T
    axis = A[:, 2]
    section = sum((A[:, i].cross(axis) * A[:, i].cross(axis).T for i in (0, 1)), sp.zeros(3))
    limits = (spread / L**2, axis * axis.T), (spread.adjugate() / L**2, section)
    return [sp.limit(sp.expand(e), L, sp.oo) for a, b in limits for e in a - b]


def lens_by_four():
    """Light over, under, and beside the lens, and in it: its alternating sum is what the lens adds.

    The outlines at heights y_1 > y_2 beside it; in the lens they have changed places.
    """
    over, under, beside, inside, y1, y2, Y = sp.symbols("over under beside inside y_1 y_2 Y")
    smooth = over * (Y - y1) + beside * (y1 - y2) + under * (Y + y2)
    reversed_ = over * (Y - y2) + inside * (y2 - y1) + under * (Y + y1)
    return sp.expand(reversed_ - smooth - (inside + beside - over - under) * (y2 - y1))


# --- brute force ---------------------------------------------------------------------------------

LAMP = (0.05, -0.02, 2.0), (0.5, 0.1, 0.05), (-0.1, 0.4, 0.03)
PLATE = (-0.1, 0.2, 0.8), (0.2, 0.05, 0.03), (-0.05, 0.2, 0.05)
BALL = (0.02, 0.1, 1.2), 0.27


def beside_ball(polygon, center, radius: float, nodes: int = 64) -> float:
    """Irradiance at the origin from what a ball leaves of a polygon of radiance one.

    Lambert's contour integral, of the polygon less that of what is hidden. The contour of the
    hidden part is made of arcs of the ball's outline, a circle of directions, and of parts of the
    polygon's edges.
    """
    if len(polygon) < 3:
        return 0.0
    far = np.linalg.norm(center)
    axis, cosine = center / far, np.sqrt(1.0 - (radius / far) ** 2)
    first = unit(np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))]))
    p, q, s = cosine * axis, radius / far * first, radius / far * np.cross(axis, first)
    hidden: Any = 0.0
    for low, high in _arcs(*(pyramid(polygon) @ way for way in (p, q, s))):
        x, weight = np.polynomial.legendre.leggauss(nodes)
        t = (0.5 * (low + high) + 0.5 * (high - low) * x)[:, None]
        ways, turns = p + np.cos(t) * q + np.sin(t) * s, np.cos(t) * s - np.sin(t) * q
        hidden += 0.25 * (high - low) * weight @ np.cross(ways, turns)[:, 2]
    ends = np.roll(polygon, -1, axis=0)
    turn = np.sign(np.cross(polygon, ends).sum(axis=0) @ polygon.mean(axis=0))
    for start, end in zip(polygon, ends, strict=True):
        low, high = _within_cone(start, end - start, axis, cosine)
        if low < high:
            one, other = start + low * (end - start), start + high * (end - start)
            n = np.cross(one, other)
            hidden += 0.5 * turn * np.arctan2(np.linalg.norm(n), one @ other) * unit(n)[2]
    return lambert(polygon) - float(hidden)


def unit(a) -> np.ndarray:
    return a / np.linalg.norm(a)


def _arcs(p, q, s) -> list[tuple[float, float]]:
    """Angles at which all of some `p + q cos + s sin` are positive."""
    size, middle = np.hypot(q, s), np.arctan2(s, q)
    crossed = np.abs(p) < size
    half = np.arccos(-p[crossed] / size[crossed])
    ends = np.concatenate([middle[crossed] - half, middle[crossed] + half]) % (2.0 * np.pi)
    ends = np.concatenate([[0.0], np.sort(ends), [2.0 * np.pi]])
    t = 0.5 * (ends[1:] + ends[:-1])[:, None]
    inside = np.all(p + np.cos(t) * q + np.sin(t) * s > 0.0, axis=1)
    return [(ends[i], ends[i + 1]) for i in np.flatnonzero(inside)]


def _within_cone(start, way, axis, cosine: float) -> tuple[float, float]:
    """The part of a segment within the cone about a unit axis: `(x . axis)^2 > cosine^2 x . x`."""
    k = [
        (p @ axis) * (q @ axis) - cosine**2 * (p @ q)
        for p, q in ((way, way), (way, start), (start, start))
    ]
    square = k[1] ** 2 - k[0] * k[2]
    if square <= 0.0:
        return 0.0, 0.0
    low, high = sorted((-k[1] + sign * np.sqrt(square)) / k[0] for sign in (1.0, -1.0))
    return max(low, 0.0), min(high, 1.0)


def brute_irradiance(place) -> float:
    """A lamp behind a plate and a ball: what neither hides."""
    lamp, plate = (corners(*shape) - place for shape in (LAMP, PLATE))
    center = np.asarray(BALL[0]) - place
    parts = lamp, clipped(lamp, pyramid(plate))
    whole, behind = (beside_ball(polygon, center, BALL[1]) for polygon in parts)
    return whole - behind


def on_line(t: float) -> float:
    """Irradiance along the line by brute force."""
    return brute_irradiance(START + t * WAY / np.linalg.norm(WAY))


# --- numeric routes ------------------------------------------------------------------------------

ROOT = np.array([-0.5, 0.0, 0.5, 1.0])  # powers of the distance in E'' where outlines touch
JUMP = np.array([0.0, 1.0, 2.0, 3.0])  # and elsewhere


@functools.cache
def scene():
    """The scene of the brute force."""
    from firstorder.space import Scene, primitive, sphere

    return Scene.of(*_flat_things(), primitive(sphere(*BALL)))


@functools.cache
def predicted():
    """The events of the scene along the line that the ball takes part in.

    Of the others, those of a lamp and a plate alone, `events` speaks.
    """
    from firstorder.space import Receiver, Scene
    from firstorder.space.discontinuities.events import visual_events_along

    at = Receiver.at(START)
    both = visual_events_along(scene(), at, along=WAY, reach=REACH)
    alone = visual_events_along(Scene.of(*_flat_things()), at, along=WAY, reach=REACH, hidden=True)
    apart = np.min(np.abs(both.x[:, None] - alone.x), axis=1)
    return both.take(apart > 1e-9)


def _flat_things():
    from firstorder.space import primitive, rectangle

    yield primitive(rectangle(*LAMP), emission=1.0, two_sided=True)
    yield primitive(rectangle(*PLATE))


def by_values(x: float, side: float, powers, scale: float = 3e-4) -> np.ndarray:
    """Coefficients of E'' beside an event by brute force, from values of E."""
    s = scale * np.arange(1.0, 7.0)[:, None]
    twice = s ** (powers + 2.0) / ((powers + 1.0) * (powers + 2.0))
    columns = np.concatenate([s**0.0, s, twice], axis=1)
    return np.linalg.solve(columns, [on_line(x + side * each) for each in s[:, 0]])[2:]


def by_autodiff(x: float, side: float, powers, scale: float = 1e-4) -> np.ndarray:
    """The same from exact E''."""
    from firstorder.numerics._batching import host_rows

    s = scale * np.array([0.5, 1.0, 2.0, 4.0])
    second = host_rows(lambda t: derivatives_on_line()(scene(), t), x + side * s)[1]
    return np.linalg.solve(s[:, None] ** powers, second)


def root_error(beside) -> float:
    """Largest error of predicted roots against E'' on both sides, over the largest root."""
    table = predicted()
    table = table.take(table.kind == "outlines that touch")
    told = np.stack([table.root_before, table.root_after])
    found = [[beside(x, side, ROOT)[0] for x in table.x] for side in (-1.0, 1.0)]
    return float(np.max(np.abs(told - found)) / np.max(np.abs(told)))


def jump_error(beside) -> float:
    """The same of jumps of E'', where a limb is in the place of an edge."""
    table = predicted()
    table = table.take(table.kind != "outlines that touch")
    found = [beside(x, 1.0, JUMP)[0] - beside(x, -1.0, JUMP)[0] for x in table.x]
    return float(np.max(np.abs(table.jump_E2 - found)) / np.max(np.abs(table.jump_E2)))


def routes(error, exact: float, bound: float) -> dict:
    return {
        "autodiff": Check(lambda: error(by_autodiff), exact),
        "fourier": na("no spectrum"),
        "brute_force": Check(lambda: error(by_values), bound),
    }


FUNCTION = "firstorder.space.discontinuities.events.visual_events_along"

ROWS = [
    Row(
        "C.space.events.touch",
        "identity",
        FUNCTION,
        symbolic=lambda: [
            *outline(),
            *plane(),
            adjugate(),
            curvature(),
            *image_of_a_limb(),
            *lens(),
            lens_by_four(),
            *hull(),
        ],
        **routes(root_error, 1e-5, 1e-4),
    ),
    Row(
        "C.space.events.limb",
        "identity",
        FUNCTION,
        symbolic=lambda: [*outline(), *image_of_a_limb(), *wall()],
        **routes(jump_error, 1e-8, 1e-5),
    ),
]
