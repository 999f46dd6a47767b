"""The rays between a flat light and a flat receiver, and the form factor that E11 pulls out.

E11 §3 and eqs. 1, 2, 11, 12. The paper's order is (v, y), the library's (y, v).
"""

from __future__ import annotations

import numpy as np
import sympy as sp

from firstorder.ledger import Check, Row, na

x, y, v = sp.symbols("x y v", real=True)
d1, d2, a = sp.symbols("d1 d2 a", positive=True)


def met():
    """Where the line from (y, 0) with slope v per unit of depth is at the depths d2 and d1."""
    t = sp.Symbol("t")
    ray = sp.Matrix([y + t * v, t])
    at = [ray.subs(t, sp.solve(ray[1] - d, t)[0])[0] for d in (d2, d1)]
    back = sp.solve(sp.Eq(at[1], x), v)[0]
    return at[0] - (d2 * v + y), sp.simplify(back - (x - y) / d1)


def steps_to_storage():
    """The map (x, y) -> (v, y) is a shear of -1 in x per y, and then a scale of 1 / d1 in x."""
    slope = sp.solve(sp.Eq(y + d1 * v, x), v)[0]
    M = sp.Matrix([slope, y]).jacobian([x, y])
    shear, scale = sp.Matrix([[1, -1], [0, 1]]), sp.diag(1 / d1, 1)
    return M - scale * shear, M.det() - 1 / d1


def factoring():
    """What pulling r out costs: from the geometry of two facing elements.

    K is two cosines over a distance. It is even about the point above the receiver, where its
    slope vanishes and its bend does not: the mean absolute deviation over a light of half-width a
    is of order a^2 there and of order a beside it.
    """
    r = sp.sqrt((x - y) ** 2 + d1**2)
    K = (d1 / r) ** 2 / r
    above = {x: 0, y: 0}
    beside = {x: d1, y: 0}
    relative = sp.simplify((K.diff(y) / K).subs(beside) * d1)
    whole = sp.integrate(K.subs(x, 0), (y, -sp.oo, sp.oo))
    return (
        K.diff(y).subs(above),
        sp.simplify((K.diff(y, 2) / K).subs(above) * d1**2) + 3,
        relative - sp.Rational(3, 2),
        sp.simplify(whole - 2),
    )


# ---------------------------------------------------------------- numeric routes

D1, D2, HALF = 1.3, 0.5, 0.4


def _strip():
    from firstorder.fields import Affine, Bars
    from firstorder.shadowfield import PLANE

    return Bars(Affine([1.0], 0.0, PLANE), [-0.1, 0.2], [1.0, 0.0, 1.0])


def layer_against_traced() -> float:
    """A strip as a layer, and as a segment of flatland that rays are traced against."""
    from firstorder.flatland import Scene, Segments, primitive
    from firstorder.shadowfield import planar_blocker, ray_visibility_by_slope

    scene = Scene.of(primitive(Segments((-0.1, 1.0 - D2), (0.2, 1.0 - D2))))
    Y, V = np.meshgrid(np.linspace(-0.803, 0.8, 37), np.linspace(-1.007, 1.0, 41), indexing="ij")
    found = np.asarray(planar_blocker(_strip(), D2)(Y, V))
    return float(np.max(np.abs(found - ray_visibility_by_slope(scene, Y, V, 1.0, D1))))


def storage_against_rays() -> float:
    """Rays followed from the light to the receiver, and named by `to_two_planes`."""
    from firstorder.shadowfield import to_two_planes

    rng = np.random.default_rng(2)
    Y, V = rng.normal(size=(2, 50))
    X = Y + D1 * V
    found = np.asarray(to_two_planes(D1).M) @ np.stack([X, Y])
    return float(np.max(np.abs(found - np.stack([Y, V]))))


def bound_is_reached() -> float:
    """The worst blocker, found by looking at each piece of the light, against the bound."""
    import jax

    from firstorder.fields import BoxProfile
    from firstorder.shadowfield import PLANE, factoring_bound

    n = 20000
    s = HALF * (2 * (np.arange(n) + 0.5) / n - 1)
    bound = jax.jit(lambda X: factoring_bound(BoxProfile(HALF, "y", PLANE), D1, -HALF, HALF, X))
    worst = 0.0
    for X in (0.0, 0.7):
        r = np.hypot(X - s, D1)
        K = D1**2 / r**3
        error = np.sum(np.where(np.mean(K) < K, K - np.mean(K), 0.0)) * 2 * HALF / n
        worst = max(worst, abs(error - float(bound(X))) / error)
    return worst


ROWS = [
    Row(
        "E11.1",
        "definition",
        implements="firstorder.shadowfield.plane.light_field.planar_blocker",
        symbolic=met,
        autodiff=na("no derivative"),
        fourier=na("no spectrum"),
        brute_force=Check(layer_against_traced, 0.0),
        note="Stored (y, v). v is the library's slope of incoming light: y = x - d1 v.",
    ),
    Row(
        "E11.2",
        "approximation",
        implements="firstorder.shadowfield.plane.light_field.factoring_bound",
        symbolic=factoring,
        autodiff=na("no derivative"),
        fourier=na("no spectrum"),
        brute_force=Check(bound_is_reached, 1e-4),
        note="h - r int f l is at most half of int |K - r| l, and the worst blocker reaches it. "
        "Relative to the light: of order (a/d1)^2 below the middle of a light of half-width a, "
        "a/d1 beside it. Exact with K inside the integral.",
    ),
    Row(
        "E11.11",
        "definition",
        implements="firstorder.shadowfield.plane.light_field.to_two_planes",
        symbolic=steps_to_storage,
        autodiff=na("no derivative"),
        fourier=na("no spectrum"),
        brute_force=Check(storage_against_rays, 1e-14),
    ),
    Row(
        "E11.12",
        "definition",
        implements="firstorder.shadowfield.plane.light_field.to_two_planes",
        symbolic=steps_to_storage,
        autodiff=na("no derivative"),
        fourier=na("no spectrum"),
        brute_force=Check(storage_against_rays, 1e-14),
        note="After the shear of (11); areas shrink by d1.",
    ),
]
