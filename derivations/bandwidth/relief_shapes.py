"""Errors of what replaces relief of any shape: mirrors that turn, heights that are seen (D05 §7).

Proofs start from vectors: a height field, an eye, the law of reflection. Numbers come from rays
that meet a relief in space one by one (`_relief_space_rays`).
"""

from __future__ import annotations

import numpy as np
import sympy as sp

from derivations.bandwidth import _relief_space_rays as rays
from firstorder.ledger import Check, Row, na

# --- proofs ------------------------------------------------------------------------------------

p, q, v = sp.symbols("p q v", real=True)
a, b, c = sp.symbols("a b c", real=True)


def _reflected(normal, e):
    return 2 * normal.dot(e) / normal.dot(normal) * normal - e


def mirror_in_relief():
    """The mirrored direction moves by this chord, and never by more than twice the slope."""
    e = sp.Matrix([sp.sin(v), 0, sp.cos(v)])
    moved = _reflected(sp.Matrix([-p, -q, 1]), e) - _reflected(sp.Matrix([0, 0, 1]), e)
    square = 4 * (p**2 + q**2 * sp.cos(v) ** 2) / (1 + p**2 + q**2)
    below = 4 * (p**2 + q**2) - square  # of the chord's square, a sum of squares over 1 + m^2
    squares = 4 * ((p**2 + q**2) ** 2 + q**2 * sp.sin(v) ** 2) / (1 + p**2 + q**2)
    return [sp.simplify(moved.dot(moved) - square), sp.simplify(below - squares)]


def rays_to_the_base():
    """A ray that meets the height h above x crosses the base at x - h W, W its slope."""
    h, x, y, w1, w2, w3, t = sp.symbols("h x y w_1 w_2 w_3 t", real=True)
    at = sp.Matrix([x, y, h]) + t * sp.Matrix([w1, w2, w3])
    there = at.subs(t, sp.solve(at[2], t)[0])
    return list((there - sp.Matrix([x - h * w1 / w3, y - h * w2 / w3, 0])).applyfunc(sp.simplify))


def normals_turn_less_than_slopes():
    """A unit normal moves by no more than the slope: the difference is a sum of squares."""
    N = sp.Matrix([-p, -q, 1]) / sp.sqrt(1 + p**2 + q**2)
    moved = N.diff(p) * a + N.diff(q) * b
    m = p**2 + q**2
    squares = ((1 + m) * m * (a**2 + b**2) + (p * a + q * b) ** 2) / (1 + m) ** 2
    return [sp.simplify(a**2 + b**2 - moved.dot(moved) - squares)]


def heights_that_are_seen():
    """The eye sees `du = (1 - V . grad h) dx` of each place: means of h and h^2 are unchanged.

    For `h^n V . grad h` is the divergence of `h^(n + 1) V / (n + 1)`, whose mean over a period is
    0.
    """
    x, y, V1, V2 = sp.symbols("x y V_1 V_2", real=True)
    h = sp.Function("h")(x, y)
    u = sp.Matrix([x - h * V1, y - h * V2])
    shown = u.jacobian([x, y]).det() - (1 - V1 * h.diff(x) - V2 * h.diff(y))
    found = [sp.expand(shown)]
    for n in (1, 2):
        flow = [h ** (n + 1) * V / (n + 1) for V in (V1, V2)]
        divergence = flow[0].diff(x) + flow[1].diff(y)
        found.append(sp.expand(h**n * (1 - V1 * h.diff(x) - V2 * h.diff(y)) - h**n + divergence))
    return found


def harmonics_in_rows():
    """Exponents 2 k^2 are at least 2 + 6 (k - 1), and rows of rows sum up to t + u + t u."""
    k, t, s = sp.symbols("k t u", positive=True)
    later = 2 * k**2 - 2 - 6 * (k - 1) - 2 * (k - 1) * (k - 2)  # k - 1 and k - 2 have one sign
    rows = (1 + t) * (1 + s) - 1 - (t + s + t * s)
    return [sp.expand(later), sp.expand(rows)]


# --- numbers -----------------------------------------------------------------------------------

TINY = 1e-5  # slope, at which chords are arcs


def _ridges(azimuth: float, slope: float = TINY):
    """One wave across the plane of incidence, at an azimuth, and its numbers."""
    f = 3.0
    k = f * np.array([[np.cos(azimuth), np.sin(azimuth)]])
    return rays.Cosines(k, np.array([slope / (2.0 * np.pi * f)]), np.zeros(1)), f


def _line(relief, f, count=4001):
    """Places along a wave."""
    return np.linspace(0.0, 1.0 / f, count)[:, None] * relief.k[0] / f


def _waves(relief, f):
    from firstorder.bandwidth import Relief

    return Relief.waves(relief.a[0], f)


def flat_by_rays() -> float:
    """`flat_shape_error` against the largest phases of rays, of the turn and of the parallax."""
    from firstorder.bandwidth import flat_shape_error

    worst = 0.0
    for azimuth, view in ((0.3, 0.7), (1.9, -0.4), (-2.5, 1.0)):
        relief, f = _ridges(azimuth)
        e = rays.to_eye(view, azimuth)
        u = _line(relief, f)
        (x, w), (x0, w0) = (by(u, relief, e) for by in (rays.traced, rays.flat))
        at = {"view": view, "reach": abs(view) + 2.0 * TINY}
        B, Bx = 0.3, 1.0
        turn = 2.0 * np.pi * B * np.linalg.norm(w - w0, axis=-1).max()
        moved = 2.0 * np.pi * Bx * np.linalg.norm(x - x0, axis=-1).max()
        ours = [float(flat_shape_error(_waves(relief, f), *band, **at))
                for band in ((B, 0.0), (0.0, Bx))]  # fmt: skip
        worst = max(worst, abs(ours[0] - turn) / turn, abs(ours[1] - moved) / moved)
    return worst


def turn_by_autodiff() -> float:
    """The same turn, by `jax.jacfwd` of the law of reflection in the slope: its norm is 2."""
    import jax
    import jax.numpy as jnp

    from firstorder.bandwidth import Relief, flat_shape_error

    e = jnp.asarray(rays.to_eye(0.8, 2.1))

    def w(slope):
        N = jnp.append(-slope, 1.0)
        return 2.0 * (N @ e) / (N @ N) * N - e

    rate = float(np.linalg.norm(np.asarray(jax.jacfwd(w)(jnp.zeros(2))), 2))
    found = flat_shape_error(Relief(0.0, TINY, 0.0), 1.0, 0.0, view=0.8, reach=0.9)
    return abs(float(found) / (2.0 * np.pi * TINY) - rate) / rate


def bumps_by_rays() -> float:
    """`bump_shape_error` against the largest turn of rays, seen aslant."""
    from firstorder.bandwidth import bump_shape_error

    worst = 0.0
    for azimuth, view in ((0.3, 0.7), (1.9, -0.4), (-2.5, 1.0)):
        relief, f = _ridges(azimuth, 1e-3)
        e = rays.to_eye(view, azimuth)
        u = _line(relief, f)
        w, w0 = (by(u, relief, e)[1] for by in (rays.traced, rays.bumped))
        true = 2.0 * np.pi * np.linalg.norm(w - w0, axis=-1).max()
        at = {"view": view, "reach": abs(view) + 0.002}
        ours = float(bump_shape_error(_waves(relief, f), 1.0, 0.0, **at))
        worst = max(worst, abs(ours - true) / true)
    return worst


def bumps_by_autodiff() -> float:
    """The same by `jax.jacfwd` of the mirrored direction in the place, at a crest."""
    import jax
    import jax.numpy as jnp

    from firstorder.bandwidth import Relief, bump_shape_error

    view, curvature, height = 0.8, 30.0, 1e-4
    e = jnp.asarray(rays.to_eye(view, 0.0))

    def w(x):
        N = jnp.append(curvature * x, 1.0)  # of h = H - K |x|^2 / 2
        return 2.0 * (N @ e) / (N @ N) * N - e

    V = e[:2] / e[2]
    turned = np.asarray(jax.jacfwd(w)(jnp.zeros(2)) @ (height * V))
    true = 2.0 * np.pi * float(np.linalg.norm(turned))
    found = bump_shape_error(Relief(height, 0.1, curvature), 1.0, 0.0, view=view, reach=1.1)
    return abs(float(found) - true) / true


def _averaged():
    """A fine wave, light that varies with its direction, and a pixel that leaves a thousandth."""
    relief, f = _ridges(0.0, 1e-3)
    view, B = 0.5, 0.8  # the phase turns by 0.01
    width = np.sqrt(np.log(1e3) / 2.0) / (np.pi * f)
    e = rays.to_eye(view, 0.0)
    Omega = B * np.array([np.cos(view), 0.0, np.sin(view)])  # along which the mirror turns light
    return relief, f, view, B, width, e, Omega


def _bound(relief, f, view, B, width):
    from firstorder.bandwidth import brdf_shape_error

    at = {"width": width, "view": view, "reach": abs(view) + 0.002}
    return float(brdf_shape_error(_waves(relief, f), B, 0.0, **at))


def pixels_by_harmonics() -> float:
    """`brdf_shape_error` against the harmonics of rays, transformed and filtered."""
    relief, f, view, B, width, e, Omega = _averaged()
    periods = np.eye(2) / f
    light = rays.wave(rays.traced(rays.cell(periods, 64), relief, e), np.zeros(2), Omega)
    true = rays.pixels(light, periods, np.zeros(2), width, light.mean())
    ours = _bound(relief, f, view, B, width)
    return abs(ours - true) / true


def pixels_by_rays() -> float:
    """The same against pixels that sum rays under a Gaussian, one by one."""
    relief, f, view, B, width, e, Omega = _averaged()
    step = 1.0 / (64.0 * f)
    u = np.arange(64)[:, None] * step * np.array([1.0, 0.0])
    mean = rays.wave(rays.traced(u, relief, e), np.zeros(2), Omega).mean()
    t = np.arange(-8.0 * width, 8.0 * width, step)
    weight = np.exp(-0.5 * (t / width) ** 2)
    weight /= weight.sum()
    seen = []
    for middle in np.linspace(0.0, 1.0 / f, 16, endpoint=False):
        at = (middle + t)[:, None] * np.array([1.0, 0.0])
        seen.append(weight @ rays.wave(rays.traced(at, relief, e), np.zeros(2), Omega))
    true = np.abs(np.array(seen) - mean).max()
    ours = _bound(relief, f, view, B, width)
    return abs(ours - true) / true


# --- rows --------------------------------------------------------------------------------------

ROWS = [
    Row(
        "C.relief.flat",
        "identity",
        implements="firstorder.bandwidth.relief_shapes.flat_shape_error",
        symbolic=lambda: [*mirror_in_relief(), *rays_to_the_base()],
        autodiff=Check(turn_by_autodiff, 1e-9),
        fourier=na("two routes"),
        brute_force=Check(flat_by_rays, 1e-4),
        note="A bound, reached by slopes in the plane of incidence; across it the mirror turns "
        "light by 2 cos(view) of the slope.",
    ),
    Row(
        "C.relief.bumps",
        "identity",
        implements="firstorder.bandwidth.relief_shapes.bump_shape_error",
        symbolic=normals_turn_less_than_slopes,
        autodiff=Check(bumps_by_autodiff, 1e-9),
        fourier=na("two routes"),
        brute_force=Check(bumps_by_rays, 1e-4),
        note="A bound, reached at crests: where heights are largest waves are bent most.",
    ),
    Row(
        "C.relief.seen",
        "identity",
        implements="firstorder.bandwidth.relief_shapes.brdf_shape_error",
        symbolic=lambda: [*heights_that_are_seen(), *harmonics_in_rows()],
        autodiff=na("two routes"),
        fourier=Check(pixels_by_harmonics, 1e-4),
        brute_force=Check(pixels_by_rays, 1e-4),
        note="A bound, reached by shallow waves of one frequency that a pixel averages.",
    ),
]
