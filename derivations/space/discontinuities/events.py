"""Visual events in space: how images of edges move for an eye, and what that makes of E' and E''.

Corollaries of our own; J12 §5 stays in flatland. The proofs start from how images move and from the
areas of the small figures that they open: a strip, a triangle cut off a corner, a triangle between
three edges. Both triangles have areas of second order, so that E'' jumps for either.

The brute force below shares nothing with the library: in NumPy it clips a lamp's polygon by the
pyramids over two plates, and adds Lambert's edge terms of what is left.
"""

from __future__ import annotations

import functools

import numpy as np
import sympy as sp

from derivations.flatland.discontinuities.events import brute_jump
from firstorder.ledger import Check, Row, na

x, h, s, w = sp.symbols("x h s omega", real=True)
r1, r2, dL, Y = sp.symbols("r_1 r_2 dL Y", positive=True)


# --- proofs --------------------------------------------------------------------------------------


def image_rate():
    """An edge whose plane has the normal m moves with -(d . m) / r across that plane."""
    d = sp.Matrix(sp.symbols("d_1:4", real=True))
    q = sp.Matrix([0, sp.Symbol("r", positive=True), 0])  # along u = y, with m = x
    way = q - x * d
    height = way[0] / sp.sqrt(way.dot(way))
    return sp.simplify(sp.diff(height, x).subs(x, 0) + d[0] / q[1])


def strip():
    """Between two edges of a plane a strip opens, by its angles above the plane.

    The receiver's normal is `(sin(omega), c)` along the line of sight and across the plane.
    """
    c, phi = sp.symbols("c phi", real=True)
    weight = (sp.sin(w) * sp.cos(phi) + c * sp.sin(phi)) * sp.cos(phi)
    light = dL * sp.integrate(weight, (phi, -sp.atan(h / r1), -sp.atan(h / r2)))
    slope = sp.diff(light, h).subs(h, 0)
    return sp.simplify(slope - dL * sp.sin(w) * (1 / r1 - 1 / r2))


def strip_by_rays():
    """Two shapes above the plane, radiances A and B before C: four rays tell the jump of E'.

    Light by the height of rays, before the plane is met: A over the near edge, B between the edges
    if they part, C below both.
    """
    A, B, C, H = sp.symbols("A B C H", positive=True)
    near, far = H / r1, H / r2  # for an eye that moves down; up, both are negative
    down = (C - A) * far + (B - A) * (near - far)
    up = (A - C) * near
    first = (up + down) / H  # E'(+) less E'(-), for E'(-) is -down / H
    told = (A + B - A - C) * (1 / r1 - 1 / r2)
    return sp.simplify(first - told)


def strip_integral():
    """`plane_slopes` integrates `sin(omega) q . u` in closed form."""
    a, b = sp.symbols("q_x q_y", real=True)
    closed = a * sp.sin(w) ** 2 / 2 + b * (w - sp.sin(w) * sp.cos(w)) / 2
    form = sp.sin(w) * (a * sp.cos(w) + b * sp.sin(w))
    return sp.simplify(sp.diff(closed, w) - form)


def strip_bend():
    """Second order of the light that goes through a plane, by coordinates along u, tau and m.

    Through its point at the distance r, for an eye at `x d`: the slope of the kernel, by r; and how
    far aside the rays that pass an edge through the point at q come through at r.
    """
    a, b, slant, t, rate = sp.symbols("a b c t lambda", real=True)
    q, r, speed = sp.symbols("q r s", positive=True)
    d, edge = sp.Matrix([a, b, speed]), sp.Matrix([0, slant, 1])
    away = sp.Matrix([r, 0, 0]) - x * d
    # The receiver's normal is at right angles to d: what it is along p it is along the ray.
    turned = sp.diff(r * sp.sin(w) / away.dot(away) ** 2, x).subs(x, 0)
    told = -sp.diff(
        4 * a * sp.sin(w) / (2 * r**2), r
    )  # over r, as `4 cos(theta) (u . d) / (2 r^2)`
    hit = x * d + t * (sp.Matrix([q, 0, 0]) + x * rate * edge - x * d)
    share = sp.solve(hit[2], t)[0]
    lean = sp.solve((share * q).subs(x, 0) - r, rate)[0]
    aside = sp.diff(hit[1].subs(t, share).subs(rate, lean), x).subs(x, 0)
    return sp.simplify(turned * r - told), sp.simplify(aside - (1 - r / q) * (b - speed * slant))


def corner():
    """Light dL between two edges that leave a corner, seen where it is over a line at s.

    Both leave to one side, with slopes t_1 and t_2; or one to either side.
    """
    t1, t2 = sp.symbols("t_1 t_2", positive=True)
    y = sp.Symbol("y", real=True)
    length = sp.integrate(1, (y, s * t1, s * t2))  # on the side of the edges; none on the other
    one_side = sp.diff(-dL * length, s) - (dL * t1 - dL * t2)  # K = dL, -dL
    over, under = sp.integrate(1, (y, s * t1, Y)), sp.integrate(1, (y, -s * t2, Y))
    both = sp.diff(-dL * over, s) - sp.diff(-dL * under, s) - (dL * t1 + dL * t2)
    return sp.simplify(one_side), sp.simplify(both)


def triangle():
    """Three lines `m_i . x = s_i` enclose `D^2 / (2 |l_1 l_2 l_3|)`, `D = sum l_i s_i`.

    With `l_i = m_j x m_k`, for which `sum l_i m_i = 0`: D does not change with the origin, which is
    put where the first two lines cross.
    """
    s3 = sp.Symbol("s_3", real=True)
    m = [sp.Matrix(sp.symbols(f"a_{i} b_{i}", real=True)) for i in (1, 2, 3)]
    sines = [sp.Matrix.hstack(m[i - 2], m[i - 1]).det() for i in range(3)]
    still = sp.Matrix.hstack(*m) * sp.Matrix(sines)
    # Along the first two lines to the third.
    ways = [sp.Matrix([-e[1], e[0]]) for e in m[:2]]
    ends = [way * (s3 / m[2].dot(way)) for way in ways]
    double = sp.Matrix.hstack(ends[1], ends[0]).det()
    area = sp.cancel(double - (sines[2] * s3) ** 2 / sp.prod(sines))
    return *still.applyfunc(sp.expand), area


def triangle_by_crossings():
    """The small triangle's light is an alternating sum over the eight cells of three lines.

    A product of three steps changes by that of their reverses: with H(-x) = 1 - H(x) every cell is
    what two lines make of it, and the triangle with a sign for each step that is reversed.
    """
    steps = sp.symbols("H_1:4")
    cells = sp.symbols("L_:8")
    total = 0
    for number, L in enumerate(cells):
        flips = [number >> i & 1 for i in range(3)]
        product = sp.prod(1 - H if f else H for H, f in zip(steps, flips, strict=True))
        total += L * product
    of_all = sp.Poly(sp.expand(total), *steps).coeff_monomial(sp.prod(steps))
    told = sum((-1) ** number.bit_count() * L for number, L in enumerate(cells))
    return sp.expand(of_all - told)


# --- brute force ---------------------------------------------------------------------------------


def clipped(polygon, normals) -> np.ndarray:
    """The part of a polygon, seen from the origin, on the positive side of planes through it."""
    for n in normals:
        kept = []
        for a, b in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
            i, j = a @ n, b @ n
            if i >= 0.0:
                kept.append(a)
            if i * j < 0.0:
                kept.append(a + i / (i - j) * (b - a))
        polygon = np.array(kept)
        if len(polygon) < 3:
            return np.zeros((0, 3))
    return polygon


def pyramid(polygon) -> np.ndarray:
    """Normals, inwards, of the planes through the origin and the edges of a convex polygon."""
    normals = np.cross(polygon, np.roll(polygon, -1, axis=0))
    return normals * np.sign(normals @ polygon.mean(axis=0))[:, None]


def lambert(polygon) -> float:
    """Irradiance at the origin, for a normal along z, from a polygon of radiance one above it."""
    if len(polygon) < 3:
        return 0.0
    a, b = polygon, np.roll(polygon, -1, axis=0)
    n = np.cross(a, b)
    size = np.linalg.norm(n, axis=1)
    angle = np.arctan2(size, np.sum(a * b, axis=1))
    return abs(0.5 * float(np.sum(angle * n[:, 2] / np.where(size > 0.0, size, 1.0))))


def brute_irradiance(place, lamp, first, second) -> float:
    """A lamp behind two plates: what neither hides, by inclusion and exclusion."""
    lamp, first, second = (np.asarray(p) - place for p in (lamp, first, second))
    one, two = pyramid(first), pyramid(second)
    behind = [clipped(lamp, n) for n in (one, two, np.concatenate([one, two]))]
    return lambert(lamp) - lambert(behind[0]) - lambert(behind[1]) + lambert(behind[2])


# --- numeric routes ------------------------------------------------------------------------------

SEEDS = (1, 2, 3)
START, WAY, REACH = np.array([-1.5, 0.07, 0.0]), np.array([0.995, 0.1, 0.0]), 3.0


def corners(center, u, v) -> np.ndarray:
    """The corners of a rectangle by its middle and its two half-edges."""
    c, u, v = (np.asarray(a, float) for a in (center, u, v))
    return np.stack([c - u - v, c + u - v, c + u + v, c - u + v])


def skew(seed: int) -> list[tuple]:
    """A lamp and two plates in nobody's plane, one over the other: middles and half-edges."""
    rng = np.random.default_rng(seed)
    sizes = ((2.0, 0.5), (1.25, 0.3), (0.65, 0.2))
    shapes = []
    for height, size in sizes:
        turn = rng.uniform(0.0, np.pi)
        tilt = rng.uniform(-0.25, 0.25, 2)
        u = size * np.array([np.cos(turn), np.sin(turn), tilt[0]])
        v = size * np.array([-np.sin(turn), np.cos(turn), tilt[1]])
        shapes.append(((*rng.uniform(-0.1, 0.1, 2), height), u, v))
    return shapes


def straight() -> list[tuple]:
    """The same with the edges of all along two axes."""
    u, v = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
    return [
        ((0.05, 0.0, 2.0), 0.5 * u, 0.4 * v),
        ((-0.1, 0.1, 1.25), 0.3 * u, 0.2 * v),
        ((0.3, -0.2, 0.65), 0.1 * u, 0.2 * v),
    ]


def scene_of(shapes):
    from firstorder.space import Scene, primitive, rectangle

    lamp, *plates = (rectangle(*shape) for shape in shapes)
    things = [primitive(lamp, emission=1.0, two_sided=True), *map(primitive, plates)]
    return Scene.of(*things)


@functools.cache
def predicted(seed: int | None):
    """The events of a scene along the line; of `straight()` for no seed."""
    from firstorder.space import Receiver
    from firstorder.space.discontinuities.events import visual_events_along

    scene = scene_of(straight() if seed is None else skew(seed))
    return visual_events_along(scene, Receiver.at(START), along=WAY, reach=REACH)


def on_line(seed: int | None):
    """Irradiance along the line by brute force."""
    shapes = [corners(*shape) for shape in (straight() if seed is None else skew(seed))]
    way = WAY / np.linalg.norm(WAY)
    return lambda t: brute_irradiance(START + t * way, *shapes)


def of_kind(kind: str):
    """Scenes with their events, and which of them are of a kind."""
    for seed in (None,) if kind == "two edges in a plane" else SEEDS:
        yield seed, predicted(seed), np.flatnonzero(predicted(seed).kind == kind)


def predicted_jumps(kind: str, table, rows) -> np.ndarray:
    return (table.jump_E1 if kind == "two edges in a plane" else table.jump_E2)[rows]


def brute_error(kind: str, step: float = 5e-4) -> float:
    """Largest error of predicted jumps against the brute force, over the largest jump."""
    order = 1 if kind == "two edges in a plane" else 2
    worst, most = 0.0, 0.0
    for seed, table, rows in of_kind(kind):
        E = on_line(seed)
        for at, jump in zip(table.x[rows], predicted_jumps(kind, table, rows), strict=True):
            apart = np.abs(table.x - at)
            room = np.min(apart[apart > 1e-9], initial=1.0)  # to the next event
            found = brute_jump(E, at, order, min(step, 0.1 * room))
            worst, most = max(worst, abs(found - jump)), max(most, abs(jump))
    return worst / most


@functools.cache
def derivatives_on_line():
    """E' and E'' at places along the line, compiled once for all scenes."""
    import jax
    import jax.numpy as jnp

    from firstorder.space import Receiver, irradiance

    start, way = jnp.asarray(START), jnp.asarray(WAY / np.linalg.norm(WAY))

    def slope(scene, t):
        def E(t):
            return irradiance(scene, Receiver.at(start + t * way))

        return jax.jvp(E, (t,), (jnp.ones_like(t),))[1]

    def both(scene, t):
        return jax.jvp(lambda t: slope(scene, t), (t,), (jnp.ones_like(t),))

    return jax.jit(jax.vmap(both, in_axes=(None, 0)))


@functools.cache
def one_sided(seed: int | None, shift: float):
    """Jumps of E' and E'' at all events, by automatic differentiation on both sides."""
    from firstorder.numerics._batching import host_rows

    scene, x = scene_of(straight() if seed is None else skew(seed)), predicted(seed).x
    t = np.concatenate([x + shift, x - shift])
    found = host_rows(lambda t: derivatives_on_line()(scene, t), t)
    return [np.subtract(*np.split(a, 2)) for a in found]


def autodiff_error(kind: str, shift: float = 3e-5) -> float:
    """The same against exact derivatives, extrapolated to the event from two distances."""
    order = 1 if kind == "two edges in a plane" else 2
    worst, most = 0.0, 0.0
    for seed, table, rows in of_kind(kind):
        near, far = (one_sided(seed, k * shift)[order - 1][rows] for k in (1.0, 2.0))
        said = predicted_jumps(kind, table, rows)
        worst = max(worst, float(np.abs(2.0 * near - far - said).max()))
        most = max(most, float(np.abs(said).max()))
    return worst / most


def routes(kind: str, bound: float) -> dict:
    return {
        "autodiff": Check(lambda: autodiff_error(kind), bound),
        "fourier": na("no spectrum"),
        "brute_force": Check(lambda: brute_error(kind), bound),
    }


FUNCTION = "firstorder.space.discontinuities.events.visual_events_along"

ROWS = [
    Row(
        "C.space.events.plane",
        "identity",
        FUNCTION,
        symbolic=lambda: [
            image_rate(),
            strip(),
            strip_by_rays(),
            strip_integral(),
            *strip_bend(),
        ],
        **routes("two edges in a plane", 1e-6),
    ),
    Row(
        "C.space.events.vertex",
        "identity",
        FUNCTION,
        symbolic=lambda: [image_rate(), *corner()],
        **routes("vertex and edge", 1e-5),
    ),
    Row(
        "C.space.events.triple",
        "identity",
        FUNCTION,
        symbolic=lambda: [*triangle(), triangle_by_crossings()],
        **routes("three edges", 1e-5),
    ),
]
