"""Visual events of walls of cylinders: what E'' does where a line of a wall lies in a plane.

Corollaries of our own. The brute force knows no outline: it adds, azimuth by azimuth, what is seen
of an upright lamp over and under an upright column, whose elevations are quotients of a height and
of where a circle is met.
"""

from __future__ import annotations

import functools

import numpy as np
import sympy as sp

from derivations.space.discontinuities.events import REACH, START, WAY, derivatives_on_line
from firstorder.ledger import Check, Row, na

h = sp.Symbol("h", real=True)
rho, D, r, H = sp.symbols("rho D r H", positive=True)


# --- proofs --------------------------------------------------------------------------------------


def lift():
    """An eye at the height h sees a wall as an edge that is `rho h^2 / (2 D^2)` farther out of it.

    Across the axis: a circle of the radius rho below the plane, which touches it at the distance D.
    """
    slope = sp.Symbol("p", real=True)  # of the ray that touches, downwards: p_1 h + p_2 h^2
    p1, p2 = sp.symbols("p_1 p_2", real=True)
    off = (h - slope * D + rho) ** 2 - rho**2 * (1 + slope**2)  # of the middle from the ray
    series = sp.expand(off.subs(slope, p1 * h + p2 * h**2))
    first = sp.solve(series.coeff(h, 1), p1)[0]
    second = sp.solve(series.coeff(h, 2).subs(p1, first), p2)[0]
    height = sp.expand(h - (first * h + second * h**2) * D)
    return sp.simplify(height - rho * h**2 / (2 * D**2))


def tip():
    """The light of a tip between a rim and what lies at the distance r_j, to second order.

    The rim `P + (cos(b) - 1) p + sin(b) q`, seen from a height h at which it is crossed (A > 0 and
    h < 0, with the wall below the plane).
    """
    qu, qv, pu, pv, slope, c0, c1 = sp.symbols("q_u q_v p_u p_v l c_0 c_1", real=True)
    b = sp.Symbol("b", positive=True)
    z, t = sp.symbols("z t", positive=True)  # sqrt(-h), and b over it
    far = sp.Symbol("A", positive=True)  # 1 / r - 1 / r_j
    along = r + (sp.cos(b) - 1) * pu + sp.sin(b) * qu
    aside = (sp.cos(b) - 1) * pv + sp.sin(b) * qv
    azimuth = sp.series(sp.atan(aside / along), b, 0, 3).removeO()
    nearness = sp.series(1 / sp.sqrt(along**2 + aside**2), b, 0, 2).removeO()
    apart = (z**2 - H * b**2 / 2) * nearness - z**2 * (1 / r - far + azimuth * slope)
    light = apart * (c0 + c1 * azimuth) * sp.diff(azimuth, b) * z
    light = sp.expand(light.subs(b, t * z))
    light = sum(light.coeff(z, k) * z**k for k in range(5))
    end = sp.sqrt(2 * r * far / H)  # both ends move in higher order, where nothing is between
    found = sp.integrate(light, (t, 0, end))
    C, turn = H / (2 * r), qv / r
    turns = -pv / (2 * r) - qu * qv / r**2
    B, rest = qu / r**2 + turn * slope, H * qu / (2 * r**2)
    S = c0 * turn * (-far * B / (2 * C) + far**2 * rest / (4 * C**2))
    S += (c1 * turn**2 + 2 * c0 * turns) * far**2 / (4 * C)
    first = c0 * turn * sp.Rational(2, 3) * far ** sp.Rational(3, 2) / sp.sqrt(C)
    return sp.simplify(sp.expand(found - first * z**3 - S * z**4))


def half_a_lens():
    """`(2/3) d (h A)^(3/2) / sqrt(C)` is half of a lens, for the curvature `2 C / d^2`."""
    d, C, s = sp.symbols("d C s", positive=True)
    lens = 4 * sp.sqrt(2) / 3 * s ** sp.Rational(3, 2) / sp.sqrt(2 * C / d**2)
    return sp.simplify(lens / 2 - sp.Rational(2, 3) * d * s ** sp.Rational(3, 2) / sp.sqrt(C))


def end_of_a_line():
    """Light through a plane between two distances, past an end P that an eye at `x d` looks past.

    The kernel is `s x cos(theta) / r^3`; past P rays come through `x (1 - r / r_P) (d . v)` aside.
    """
    x, aside, speed, q = sp.symbols("x d_v s q", positive=True)
    r1, r2 = sp.symbols("r_1 r_2", positive=True)
    eye, P = sp.Matrix([0, x * aside]), sp.Matrix([q, 0])
    at = eye + (P - eye) * (r / q)  # to first order at the distance r along u
    moved = sp.diff(at[1], x) - (1 - r / q) * aside
    second = sp.diff(speed * x * x * aside, x, 2) * sp.integrate((1 - r / q) / r**3, (r, r1, r2))
    z1, z2 = 1 / r1, 1 / r2
    told = 2 * speed * aside * ((z1**2 / 2 - z1 / q) - (z2**2 / 2 - z2 / q))
    return sp.simplify(moved), sp.simplify(second - told)


# --- brute force ---------------------------------------------------------------------------------

COLUMN, RADIUS, HEIGHTS = np.array([-0.3, 0.6]), 0.2, np.array([0.3, 0.8])
LAMP, SPAN, LEVELS = np.array([0.1, 1.5]), np.array([0.35, 0.1]), np.array([0.5, 1.5])
X, W = np.polynomial.legendre.leggauss(48)


def _elevations(place, azimuth) -> tuple[np.ndarray, np.ndarray]:
    """Tangents of elevations at which the lamp, and the column, begin and end; by azimuth."""
    way = np.stack([np.cos(azimuth), np.sin(azimuth)])
    across = np.array([-SPAN[1], SPAN[0]])
    far = (across @ (LAMP - place)) / (across @ way)
    w = COLUMN - place
    along, off = w @ way, w[1] * way[0] - w[0] * way[1]
    half = np.sqrt(np.maximum(RADIUS**2 - off**2, 0.0))
    column = np.stack([HEIGHTS[0] / (along + half), HEIGHTS[1] / (along - half)])
    met = np.abs(off) < RADIUS
    return LEVELS[:, None] / far, np.where(met, column, 1e9)


def _seen(place, azimuth) -> np.ndarray:
    """Irradiance from the lamp per azimuth, from what is under the column and what is over it."""
    (low, high), (bottom, top) = _elevations(place, azimuth)

    def light(begin, end):
        sines = [t * t / (1.0 + t * t) for t in (begin, np.maximum(begin, end))]
        return 0.5 * (sines[1] - sines[0])

    return light(low, np.minimum(high, bottom)) + light(np.maximum(low, top), high)


def on_line(t: float) -> float:
    """Irradiance along the line, between azimuths at which anything begins or ends."""
    place = (START + t * WAY / np.linalg.norm(WAY))[:2]
    ends = np.sort(np.arctan2(*(LAMP + np.outer([-1.0, 1.0], SPAN) - place).T[::-1]))
    w = COLUMN - place
    half = np.arcsin(RADIUS / np.linalg.norm(w))
    sides = np.arctan2(w[1], w[0]) + half * np.array([-1.0, 1.0])
    breaks = np.concatenate([ends, sides, _level_crossings(place, *sides)])
    breaks = np.unique(np.clip(breaks, *ends))
    middle, half = 0.5 * (breaks[1:] + breaks[:-1]), 0.5 * np.diff(breaks)
    turn = 0.5 * np.pi * X  # elevations of the column end like roots
    azimuth = middle[:, None] + half[:, None] * np.sin(turn)
    weights = half[:, None] * 0.5 * np.pi * np.cos(turn) * W
    return float(np.sum(weights * _seen(place, azimuth.ravel()).reshape(azimuth.shape)))


def _level_crossings(place, first, last) -> np.ndarray:
    """Azimuths at which the column ends at an elevation at which the lamp does."""

    def apart(turn):
        azimuth = 0.5 * (first + last) - 0.5 * (last - first) * np.cos(turn)
        lamp, column = _elevations(place, azimuth)
        return azimuth, (lamp[:, None] - column).reshape(4, -1)

    turn = np.geomspace(1e-7, 0.5 * np.pi, 400)
    turn = np.concatenate([turn, np.pi - turn[-2::-1]])
    signs = apart(turn)[1] > 0.0
    which, cell = np.nonzero(signs[:, 1:] != signs[:, :-1])
    low, high, number = turn[cell], turn[cell + 1], np.arange(len(cell))
    for _ in range(60):
        middle = 0.5 * (low + high)
        same = (apart(middle)[1][which, number] > 0.0) == signs[which, cell]
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return apart(low)[0]


# --- numeric routes ------------------------------------------------------------------------------


@functools.cache
def scene():
    from firstorder.space import Scene, cylinder, primitive, rectangle

    middle = (*LAMP, np.mean(LEVELS))
    lamp = rectangle(middle, (*SPAN, 0.0), (0.0, 0.0, 0.5 * np.ptp(LEVELS)))
    column = cylinder((*COLUMN, HEIGHTS[0]), (*COLUMN, HEIGHTS[1]), RADIUS)
    return Scene.of(primitive(lamp, emission=1.0, two_sided=True), primitive(column))


@functools.cache
def predicted():
    """Kinks of E where a line of the column lies in a plane with an edge of the lamp."""
    from firstorder.space import Receiver
    from firstorder.space.discontinuities.events import visual_events_along

    table = visual_events_along(scene(), Receiver.at(START), along=WAY, reach=REACH)
    return table.take(table.kind == "two edges in a plane")


POWERS = 0.5 * np.arange(-1.0, 5.0)  # of the distance in E''


def by_values(x: float, side: float, scale: float = 1e-3) -> np.ndarray:
    """Coefficients of E'' beside an event by brute force, from values of E."""
    s = scale * np.linspace(0.2, 2.0, 8)[:, None]
    twice = s ** (POWERS + 2.0) / ((POWERS + 1.0) * (POWERS + 2.0))
    columns = np.concatenate([s**0.0, s, twice], axis=1)
    size = np.max(np.abs(columns), axis=0)
    values = [on_line(x + side * each) for each in s[:, 0]]
    return (np.linalg.solve(columns / size, values) / size)[2:]


def by_autodiff(x: float, side: float, scale: float = 1e-4) -> np.ndarray:
    """The same from exact E''."""
    from firstorder.numerics._batching import host_rows

    s = scale * np.linspace(0.2, 2.0, len(POWERS))
    second = host_rows(lambda t: derivatives_on_line()(scene(), t), x + side * s)[1]
    columns = s[:, None] ** POWERS
    size = np.max(np.abs(columns), axis=0)
    return np.linalg.solve(columns / size, second) / size


def error(beside) -> float:
    """Largest error of predicted roots and jumps against E'' on both sides, over the largest."""
    table = predicted()
    before, after = (np.array([beside(x, side) for x in table.x]).T for side in (-1.0, 1.0))
    pairs = [
        (table.root_before, before[0]),
        (table.root_after, after[0]),
        (table.jump_E2, after[1] - before[1]),
    ]
    return max(float(np.max(np.abs(a - b)) / np.max(np.abs(a))) for a, b in pairs)


ROWS = [
    Row(
        "C.space.events.wall",
        "identity",
        "firstorder.space.discontinuities.events.visual_events_along",
        symbolic=lambda: [lift(), tip(), half_a_lens(), *end_of_a_line()],
        autodiff=Check(lambda: error(by_autodiff), 1e-6),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: error(by_values), 2e-4),
    ),
]
