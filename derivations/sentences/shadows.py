"""R07 §6 to §8 in words: transport, sums of steps, the angle of (38), merged edges."""

from __future__ import annotations

import functools

import mpmath as mp
import numpy as np
import sympy as sp

from derivations.visibility.gradients import PLACE, _pieces, brute, light, lobe
from firstorder.ledger import Check, Counterexample, Row, na

VISIBILITY = "firstorder.visibility.gradients"

# --- §6.1: the transport of (23) -----------------------------------------------------------------

NORMAL = 0.2  # the normal's angle, of a flat receiver that leans


def reflected_by_parts():
    """`T = L(omega) rho(2 n - theta - omega)`: T_theta = dT/domega - L_omega rho.

    So int T_theta V domega has the jumps of T V with the sign +, where rho(theta - omega) has -.
    """
    omega, theta, n, t = sp.symbols("omega theta n t", real=True)
    L, rho = sp.Function("L")(omega), sp.Function("rho")
    T = L * rho(2 * n - theta - omega)
    slope = rho(t).diff(t).subs(t, 2 * n - theta - omega)
    inside = L.diff(omega) * rho(2 * n - theta - omega)
    return [
        sp.simplify((T.diff(theta) - T.diff(omega) + inside).doit()),
        sp.simplify((T.diff(theta) + L * slope).doit()),
    ]


def _mirrored(lib, x, theta, omega):
    return light(lib, x, omega) * lobe(lib, 2.0 * NORMAL - theta - omega)


def _jumps(x, theta):
    """Sum of sgn_j T(alpha_j), and T V at the horizon's two ends, upper less lower."""
    pieces = _pieces(mp, mp.mpf(x))
    ends = [e for piece in pieces for e in piece]
    T = [_mirrored(mp, x, theta, e) for e in ends]
    signs = (1, -1) * 2
    return sum(s * t for s, t in zip(signs, T[1:-1], strict=True)), T[-1] - T[0]


def printed_edges(x, theta):
    """(35): the signed sum with the sign -."""
    return float(-_jumps(x, theta)[0])


def needed_edges(x, theta):
    """What the edges must add: all of B_theta, less what is smooth and what the horizon adds.

    By differences of quadrature; with `-int L_omega rho V + [T V]` known.
    """
    with mp.workdps(40):
        h = mp.mpf(10) ** -9
        X, angle = mp.mpf(x), mp.mpf(theta)
        whole = (brute(X, angle + h, _mirrored) - brute(X, angle - h, _mirrored)) / (2 * h)

        def inside(lib, x, t, w):
            slope = (light(lib, x, w + h) - light(lib, x, w - h)) / (2 * h)
            return slope * lobe(lib, 2.0 * NORMAL - t - w)

        return float(whole + brute(X, angle, inside) - _jumps(X, angle)[1])


@functools.cache
def _library_slope():
    """B_theta by the library at the reflected direction, of which theta is the negative."""
    import jax.numpy as jnp

    import firstorder.visibility as vis
    from derivations.visibility.gradients import SLABS

    X, angle = PLACE
    ends = [
        vis.point_edge_angle(jnp.array([slab[k] for slab in SLABS]), jnp.array([X, 0.0]))
        for k in (0, 1)
    ]
    split = vis.angular_derivative_by_parts(
        functools.partial(light, jnp),
        functools.partial(lobe, jnp),
        X,
        2.0 * NORMAL - angle,
        vis.visible_edges(*ends),
    )
    return -float(split.total)


def reflected_slope(route) -> float:
    """That slope against differences of quadrature, or against autodiff of a sum over pieces."""
    X, angle = PLACE
    if route == "brute":
        with mp.workdps(40):
            h = mp.mpf(10) ** -9
            up, down = (brute(mp.mpf(X), mp.mpf(angle) + e, _mirrored) for e in (h, -h))
            truth = float((up - down) / (2 * h))
    else:
        truth = _slope_by_autodiff(X, angle)
    return abs(_library_slope() / truth - 1.0)


def _slope_by_autodiff(x, theta):
    import jax
    import jax.numpy as jnp

    t, weights = np.polynomial.legendre.leggauss(40)
    pieces = [[float(e) for e in piece] for piece in _pieces(mp, mp.mpf(x))]

    def B(angle):
        total = 0.0
        for low, high in pieces:
            w = 0.5 * (high + low) + 0.5 * (high - low) * t
            total += 0.5 * (high - low) * jnp.sum(weights * _mirrored(jnp, x, angle, w))
        return total

    return float(jax.grad(B)(theta))


# --- §6.2: visibility as a sum of steps ----------------------------------------------------------


def steps_of_three():
    """H for each end into the dark and 1 - H for each end out of it, of three blockers apart.

    Off every edge the sum is V and one less than the blockers are many; so slopes agree.
    """
    omega = sp.Symbol("omega", real=True)
    alphas = (-3, -2, -1, 1, 2, 3)
    total = sum(sp.Heaviside(a - omega) for a in alphas[::2])
    total += sum(1 - sp.Heaviside(a - omega) for a in alphas[1::2])
    places = [sp.Rational(k, 2) for k in range(-7, 8, 2)]
    blockers = list(zip(alphas[::2], alphas[1::2], strict=True))
    seen = [int(not any(low < p < high for low, high in blockers)) for p in places]
    return [total.subs(omega, p) - v - 2 for p, v in zip(places, seen, strict=True)]


ENDS = (((0.9, 1.0), (0.4, 1.2)), ((-0.3, 0.8), (-0.9, 1.1)))  # two slabs, apart from all below


def summed_steps(omega):
    """The paper's sum, H and 1 - H, over the edges of both slabs, seen from the origin."""
    total = 0.0
    for slab in ENDS:
        low, high = sorted(np.arctan2(-px, py) for px, py in slab)
        total += (low > omega) + (1.0 - (high > omega))
    return float(total)


def ray_is_free(omega, ends=ENDS):
    """V by a ray: it meets a slab if that has its ends on both sides of it."""
    u = np.array([-np.sin(omega), np.cos(omega)])
    sides = [[u[0] * q[1] - u[1] * q[0] for q in slab] for slab in ends]
    return float(all(one * two > 0 for one, two in sides))


def steps_by_rays(trials=40) -> float:
    """The library's sum of signed steps, start and all, against rays past random slabs."""
    import jax.numpy as jnp

    import firstorder.visibility as vis

    rng = np.random.default_rng(62)
    worst = 0.0
    for _ in range(trials):
        ends = np.stack([rng.uniform(-2, 2, (3, 2)), rng.uniform(0.3, 2.0, (3, 2))], -1)
        edges = vis.visible_edges(*(vis.point_edge_angle(jnp.asarray(ends[:, k])) for k in (0, 1)))
        omega = rng.uniform(-1.5, 1.5, 30)
        ours = np.asarray(edges.visibility(jnp.asarray(omega)))
        worst = max(worst, *np.abs(ours - [ray_is_free(w, ends) for w in omega]))
    return float(worst)


# --- §7.1: the angle of (38) ---------------------------------------------------------------------


def angle_from_the_pole():
    """With `w = (sin a, 0, cos a)`, (42), a is from the pole; sin(theta) dtheta is its measure."""
    alpha, theta, phi = sp.symbols("alpha theta phi", real=True)
    w = sp.Matrix([sp.sin(alpha), 0, sp.cos(alpha)])
    u = sp.Matrix([sp.sin(theta) * sp.cos(phi), sp.sin(theta) * sp.sin(phi), sp.cos(theta)])
    area = u.diff(theta).cross(u.diff(phi)).dot(u)
    sky = sp.integrate(sp.integrate(area, (theta, 0, sp.pi / 2)), (phi, 0, 2 * sp.pi))
    return [
        w.dot(sp.Matrix([0, 0, 1])) - sp.cos(alpha),
        sp.simplify(area - sp.sin(theta)),
        sky - 2 * sp.pi,
    ]


def visible_by_rays(height, radius, rays=4001):
    """Solid angle left by a ball overhead: rays, even in solid angle."""
    z = (np.arange(rays) + 0.5) / rays
    return float(2.0 * np.pi * np.mean(height**2 * (1.0 - z**2) >= radius**2))


def visible_if_elevation(height, radius):
    """(47) with theta read as elevation: the ball's edge is at the elevation of its limb."""
    limb = np.pi / 2 - np.arcsin(radius / height)  # V = 1 below it
    return float(2.0 * np.pi * (1.0 - np.cos(limb)))


def polar_against_components() -> float:
    """The library's direction of (theta, phi) against its components."""
    import jax.numpy as jnp

    from firstorder.conventions import polar

    theta, phi = np.random.default_rng(38).uniform(0.0, 1.5, (2, 20))
    ours = np.asarray(polar(jnp.asarray(theta), jnp.asarray(phi)))
    true = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)
    return float(np.max(np.abs(ours - true)))


# --- §8.1: merged intervals ----------------------------------------------------------------------


def union():
    """[0, pi/4] and [pi/6, pi/3] overlap: their union runs from the least to the largest end."""
    one, two = sp.Interval(0, sp.pi / 4), sp.Interval(sp.pi / 6, sp.pi / 3)
    merged = one.union(two)
    return [merged.start + sp.Integer(0), merged.end - sp.pi / 3, merged.measure - sp.pi / 3]


def _merged(angles):
    """Edges that the library keeps of two slabs whose ends are seen at these angles."""
    import jax.numpy as jnp

    import firstorder.visibility as vis

    points = jnp.stack([-jnp.sin(angles), jnp.cos(angles)], -1)
    return vis.visible_edges(vis.point_edge_angle(points[:, 0]), vis.point_edge_angle(points[:, 1]))


def merged_edges() -> float:
    """The paper's numbers: two discontinuities and not four, at 0 and pi/3."""
    import jax.numpy as jnp

    kept = _merged(jnp.array([[0.0, np.pi / 4], [np.pi / 6, np.pi / 3]])).edges
    shown = np.sort(np.asarray(kept.value)[np.asarray(kept.jump) != 0.0])
    return float(np.max(np.abs(shown - [0.0, np.pi / 3]))) if shown.size == 2 else np.inf


FLAT = {"fourier": na("no spectrum")}
ROWS = [
    Row(
        "R07.s6.1b",
        "over-claim",
        implements=f"{VISIBILITY}.angular_derivative_by_parts",
        symbolic=reflected_by_parts,
        autodiff=Check(lambda: reflected_slope("autodiff"), 1e-12),
        brute_force=Check(lambda: reflected_slope("brute"), 1e-12),
        **FLAT,
        corrected="T = L(x, omega) rho(2 n - theta - omega) by (23), and with it the edges add "
        "sum_j +sgn_j T(alpha_j) to B_theta, not -sgn_j",
        counterexample=Counterexample(
            {"x": 0.12, "theta": 0.3}, printed=printed_edges, true=needed_edges
        ),
        note="Printed and true are what edges add to B_theta. The library's rule is for "
        "rho(theta - omega); here it is read at theta_r, and its sign turned.",
    ),
    Row(
        "R07.s6.2a",
        "over-claim",
        implements=f"{VISIBILITY}.VisibilityEdges.visibility",
        symbolic=steps_of_three,
        autodiff=na("no derivative"),
        brute_force=Check(steps_by_rays, 1e-12),
        **FLAT,
        corrected="up to a constant: the sum is V + (blockers - 1). V itself is its value at one "
        "end and signed steps from there",
        counterexample=Counterexample({"omega": -1.2}, printed=summed_steps, true=ray_is_free),
        note="Gradients, for which it is used, do not see the constant.",
    ),
    Row(
        "R07.s7.1a",
        "misprint",
        implements="firstorder.conventions.polar",
        symbolic=angle_from_the_pole,
        autodiff=na("no derivative"),
        brute_force=Check(polar_against_components, 1e-14),
        **FLAT,
        corrected="theta is the polar angle, from the normal",
        counterexample=Counterexample(
            {"height": 2.0, "radius": 1.5}, printed=visible_if_elevation, true=visible_by_rays
        ),
        note="So (42) and (47) have it. Printed and true are what a ball overhead leaves of the "
        "sky [sr].",
    ),
    Row(
        "R07.s8.1a",
        "identity",
        implements=f"{VISIBILITY}.visible_edges",
        symbolic=union,
        autodiff=na("one route"),
        brute_force=Check(merged_edges, 1e-12),
        **FLAT,
        note="`Visible` is said of the spheres: these are the angles that they cover. At theta = 0 "
        "the weight sin(alpha) of (48) is zero.",
    ),
]
