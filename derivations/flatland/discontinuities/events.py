"""Visual events: how fast edges move for an eye that moves, and what that makes of E' and E''.

Corollaries of our own (J12 §5-6 has none of them). The proofs start from the sine of the angle at
which an edge is seen. The brute force below is exact too, but shares nothing with the library:
plain loops over angles at which segments end and circles begin, in NumPy, and one-sided
differences.
"""

from __future__ import annotations

import functools
import itertools
import math

import numpy as np
import sympy as sp

from firstorder.ledger import Check, Row, na

x, a, k = sp.symbols("x theta kappa", real=True)
r1, r2, R, dL, J, I0 = sp.symbols("r_1 r_2 R dL J I", positive=True)


# --- proofs --------------------------------------------------------------------------------------


def seen_sine(point):
    """Sine of the angle, counter-clockwise from +y, of a point seen from (x, 0)."""
    return -(point[0] - x) / sp.sqrt((point[0] - x) ** 2 + point[1] ** 2)


def gradient_jump():
    """Two points in line: on one side of the event `dL` is seen between them, on the other not.

    The exposed light is `dL (sin theta_near - sin theta_far)` where it is positive.
    """
    near, far = ([-r * sp.sin(a), r * sp.cos(a)] for r in (r1, r2))
    exposed = dL * (seen_sine(near) - seen_sine(far))
    claim = dL * sp.cos(a) ** 2 * (1 / r1 - 1 / r2)
    there = {x: 0}
    return (
        sp.simplify(exposed.subs(there)),
        sp.simplify(sp.diff(exposed, x).subs(there) - claim),
    )


def tangent_is_a_point():
    """A tangent to a circle turns as if it passed the fixed point of tangency."""
    X, Y = sp.symbols("X Y", positive=True)
    d = sp.sqrt((X - x) ** 2 + Y**2)
    angle = sp.atan2(X - x, Y) + sp.asin(R / d)  # clockwise angle of the tangent
    t = sp.sqrt(X**2 + Y**2 - R**2)  # distance to the point of tangency
    turn = -sp.diff(angle, x).subs(x, 0)
    beyond = sp.asin(R / sp.sqrt(X**2 + Y**2))
    cosine = sp.cos(sp.atan2(X, Y) + beyond)
    return sp.simplify(sp.expand_trig(sp.simplify(turn) - cosine / t).rewrite(sp.sqrt))


def rising_edge():
    """On a valley (kappa > 0) an edge at the angle pi/2 - kappa x shows `dL (1 - cos(kappa x))`."""
    shown = dL * (1 - sp.sin(sp.pi / 2 - k * x))
    at = {x: 0}
    return (
        shown.subs(at),
        sp.diff(shown, x).subs(at),
        sp.simplify(sp.diff(shown, x, 2).subs(at) - k**2 * dL),
    )


def point_light():
    """E of a point light at p on a curve of curvature kappa, and its two derivatives.

    By the equations of Frenet: position' = t, t' = kappa n, n' = -kappa t.
    """
    q = sp.Function("a")(x), sp.Function("b")(x)  # n.p and t.p
    rules = {q[0].diff(x): -k * q[1], q[1].diff(x): k * q[0] - 1}
    A, B = sp.symbols("a b", real=True)
    q2 = q[0] ** 2 + q[1] ** 2
    E = q[0] / q2
    E1 = E.diff(x).subs(rules)
    E2 = E1.diff(x).subs(rules)
    square = A**2 + B**2
    put = {q[0]: A, q[1]: B}
    first = -k * B / square + 2 * A * B / square**2
    turn = k * A - 1
    second = (
        -k * turn / square
        - 2 * k * B**2 / square**2
        + (-2 * k * B**2 + 2 * A * turn) / square**2
        + 8 * A * B**2 / square**3
    )
    dusk = first.subs(A, 0) + k / B  # B = r at angle -pi/2, -r at pi/2
    return sp.simplify(E1.subs(put) - first), sp.simplify(E2.subs(put) - second), sp.simplify(dusk)


def total_error():
    """What a linear extrapolation is off by beyond a jump, added up."""
    at, reach = sp.symbols("a R_r", positive=True)
    step = sp.Symbol("J_0", real=True)
    total = sp.integrate(step + J * (x - at), (x, at, reach))
    return sp.simplify(total - step * (reach - at) - J * (reach - at) ** 2 / 2)


# --- brute force ---------------------------------------------------------------------------------

# A segment: (start, end, radiance of its left, of its right). A circle: (center, radius, radiance).
SEGMENTS = [
    ((0.7, 1.1), (-0.2, 1.3), 1.0, 0.4),
    ((-0.35, 0.55), (0.05, 0.6), 0.3, 0.0),
]
CIRCLES = [((0.55, 0.62), 0.13, 0.2), ((-0.75, 0.9), 0.2, 0.7)]
LIGHT = ((0.3, 0.95), 0.8)


def _meet(p, u, segments, circles):
    """Distance and radiance of what a ray meets first."""
    best, L = math.inf, 0.0
    for start, end, front, back in segments:
        e = (end[0] - start[0], end[1] - start[1])
        q = (start[0] - p[0], start[1] - p[1])
        det = u[0] * e[1] - u[1] * e[0]
        if det == 0.0:
            continue
        t, s = (q[0] * e[1] - q[1] * e[0]) / det, (q[0] * u[1] - q[1] * u[0]) / det
        if 0.0 < t < best and 0.0 <= s <= 1.0:
            best, L = t, front if det > 0.0 else back
    for c, radius, glow in circles:
        w = (c[0] - p[0], c[1] - p[1])
        along = w[0] * u[0] + w[1] * u[1]
        square = radius**2 - (w[0] ** 2 + w[1] ** 2 - along**2)
        if square > 0.0 and 0.0 < along - math.sqrt(square) < best:
            best, L = along - math.sqrt(square), glow
    return best, L


def brute_irradiance(p, n, segments=None, circles=None, light=None) -> float:
    """Irradiance at p under a normal at the angle n: every angle sorted, one ray in each gap."""
    segments = SEGMENTS if segments is None else segments
    circles = CIRCLES if circles is None else circles

    def angle(q):
        return math.atan2(-(q[0] - p[0]), q[1] - p[1])

    angles = [angle(q) for s in segments for q in s[:2]]
    for c, radius, _ in circles:
        half = math.asin(radius / math.hypot(c[0] - p[0], c[1] - p[1]))
        angles += [angle(c) - half, angle(c) + half]
    local = [(g - n + math.pi) % (2.0 * math.pi) - math.pi for g in angles]
    half = 0.5 * math.pi
    ends = sorted([-half, half, *(g for g in local if abs(g) < half)])
    E = 0.0
    for low, high in itertools.pairwise(ends):
        g = n + 0.5 * (low + high)
        _, L = _meet(p, (-math.sin(g), math.cos(g)), segments, circles)
        E += L * (math.sin(high) - math.sin(low))
    if light:
        (lx, ly), power = light
        d = math.hypot(lx - p[0], ly - p[1])
        u = ((lx - p[0]) / d, (ly - p[1]) / d)
        cosine = -math.sin(n) * u[0] + math.cos(n) * u[1]
        if cosine > 0.0 and _meet(p, u, segments, circles)[0] > d:
            E += power * cosine / d
    return E


# Fornberg's weights of one-sided differences, six points, for value, first and second derivative.
_STEPS = np.arange(1, 8)
_ONE_SIDED = [
    np.linalg.solve(
        np.vander(_STEPS, increasing=True).T.astype(float), math.factorial(m) * np.eye(7)[m]
    )
    for m in range(3)
]


def brute_jump(E, at: float, order: int, step: float = 2e-3) -> float:
    """Jump of a derivative of `E(x)` at a place, by differences on either side of it."""
    sides = []
    for sign in (1.0, -1.0):
        values = np.array([E(at + sign * step * j) for j in _STEPS])
        sides.append(sign**order * values @ _ONE_SIDED[order] / step**order)
    return float(sides[0] - sides[1])


# --- numeric routes ------------------------------------------------------------------------------

FLOOR, BALL = 0, 3


@functools.cache
def lit_scene():
    """A floor, lights above, a point light; receivers are the floor and the first circle."""
    from firstorder.flatland import Circles, PointLights, Scene, Segments, primitive

    floor = primitive(Segments((-2.0, 0.0), (2.0, 0.0)), name="floor")
    straight = [primitive(Segments(s, e), emission=(f, b)) for s, e, f, b in SEGMENTS]
    round_ = [primitive(Circles(c, r), emission=L) for c, r, L in CIRCLES]
    return Scene.of(floor, *straight, *round_, points=PointLights(*LIGHT))


@functools.cache
def predicted():
    """All visual events on the fronts of the floor and the circle."""
    from firstorder.flatland.discontinuities.events import visual_events

    table = visual_events(lit_scene())
    return table.take(table.front & np.isin(table.receiver, (FLOOR, BALL)))


def on_floor(x):
    return brute_irradiance((x, 0.0), 0.0, light=LIGHT)


def on_ball(arc):
    """The circle itself does not block what is above its horizon."""
    (cx, cy), radius, _ = CIRCLES[0]
    g = -arc / radius
    p = (cx - radius * math.sin(g), cy + radius * math.cos(g))
    return brute_irradiance(p, g, circles=CIRCLES[1:], light=LIGHT)


def selected(kinds, order):
    table = predicted().take(np.isin(predicted().kind, kinds))
    return table, (table.jump_E, table.jump_E1, table.jump_E2)[order]


def brute_error(kinds, order, step=1e-3) -> float:
    """Largest error of predicted jumps against the brute force, over the largest jump."""
    table, said = selected(kinds, order)
    worst = 0.0
    for index, s, jump in zip(table.receiver, table.s, said, strict=True):
        E, length = (on_floor, 4.0) if index == FLOOR else (on_ball, 2.0 * math.pi * CIRCLES[0][1])
        others = predicted().s[predicted().receiver == index]
        apart = np.abs(others - s)
        room = length * np.min(apart[apart > 1e-9], initial=1.0)  # to the next event
        shift = -2.0 if index == FLOOR else 0.0
        there = brute_jump(E, shift + length * s, order, min(step, 0.1 * room))
        worst = max(worst, abs(there - jump))
    return worst / float(np.abs(said).max())


@functools.cache
def one_sided(shift=1e-7):
    """Jumps of E, E' and E'' in arc length at all events, by automatic differentiation."""
    import jax
    import jax.numpy as jnp

    from firstorder.flatland import irradiance, receiver

    scene, table = lit_scene(), predicted()
    length = np.where(table.receiver == FLOOR, 4.0, 2.0 * np.pi * CIRCLES[0][1])

    def both(index, s):
        def E(t):
            return irradiance(scene, receiver(scene, index, t))

        def first(t):
            return jax.jvp(E, (t,), (jnp.ones_like(t),))

        (value, slope), (_, bend) = jax.jvp(first, (s,), (jnp.ones_like(s),))
        return value, slope, bend

    s, index = (np.concatenate([a, a]) for a in (table.s, table.receiver))
    s = s + np.repeat([shift, -shift], len(table))
    found = jax.jit(jax.vmap(both))(jnp.asarray(index), jnp.asarray(s))
    sides = [np.split(np.asarray(f), 2) for f in found]
    return [(a - b) / length**order for order, (a, b) in enumerate(sides)]


def autodiff_error(kinds, order) -> float:
    _, said = selected(kinds, order)
    there = one_sided()[order][np.isin(predicted().kind, kinds)]
    return float(np.abs(there - said).max() / np.abs(said).max())


PAIRS = ("two points", "point and tangent", "two tangents", "edge-on")

ROWS = [
    Row(
        "C.events.gradient",
        "identity",
        "firstorder.flatland.discontinuities.events.visual_events",
        symbolic=lambda: [*gradient_jump(), tangent_is_a_point()],
        autodiff=Check(lambda: autodiff_error(PAIRS, 1), 1e-4),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: brute_error(PAIRS, 1), 1e-6),
        note="Autodiff is taken 1e-7 in the parameter to either side, where E'' has moved it.",
    ),
    Row(
        "C.events.shadow",
        "identity",
        "firstorder.flatland.discontinuities.events.visual_events",
        symbolic=point_light,
        autodiff=Check(lambda: autodiff_error(("shadow",), 1), 1e-4),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: brute_error(("shadow",), 0), 1e-9),
    ),
    Row(
        "C.events.horizon",
        "identity",
        "firstorder.flatland.discontinuities.events.visual_events",
        symbolic=rising_edge,
        autodiff=Check(lambda: autodiff_error(("horizon",), 2), 1e-4),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: brute_error(("horizon",), 2), 1e-5),
    ),
    Row(
        "C.events.dusk",
        "identity",
        "firstorder.flatland.discontinuities.events.visual_events",
        symbolic=lambda: point_light()[2],
        autodiff=Check(lambda: autodiff_error(("dusk",), 1), 1e-4),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: brute_error(("dusk",), 1), 1e-7),
    ),
]
