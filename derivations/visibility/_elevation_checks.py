"""The library's closed forms for edge angles against bisected angles and against autodiff."""

from __future__ import annotations

import functools

import mpmath as mp
import numpy as np

from derivations.visibility._elevation_truth import (
    LIMBS,
    RIMS,
    STEP,
    bisected,
    differences,
    limb_angle,
    ray_meets,
    rim_angle,
)


def ours(kind: str, i: int):
    """The library's closed forms at the touched point, found from the bisected angle alone."""
    return _all_ours(kind)[i]


@functools.cache
def _all_ours(kind: str):
    import jax
    import jax.numpy as jnp

    from firstorder.visibility import (
        contour_elevation,
        contour_elevation_hessian,
        crease_elevation,
        crease_elevation_hessian,
    )

    if kind == "rim":
        rows = [_touched_rim(i) for i in range(len(RIMS))]
        args = [jnp.asarray(np.stack(a)) for a in zip(*rows, strict=True)]
        found = jax.jit(
            lambda p, k, phi: (
                crease_elevation(p, k, phi),
                crease_elevation_hessian(p, k, 0.0 * k, phi),
            )
        )(*args)
    else:
        rows = [_touched_limb(i) for i in range(len(LIMBS))]
        args = [jnp.asarray(np.stack(a)) for a in zip(*rows, strict=True)]
        found = jax.jit(
            lambda p, n, H, phi: (
                contour_elevation(p, n, phi),
                contour_elevation_hessian(p, n, H, phi),
            )
        )(*args)
    found = jax.tree.map(np.asarray, found)
    return [jax.tree.map(lambda a, i=i: a[i], found) for i in range(len(rows))]


def _ray(kind: str, i: int):
    alpha, phi = differences(kind, i)[0], (LIMBS[i] if kind == "limb" else RIMS[i])[2]
    return phi, np.array([np.sin(alpha) * np.cos(phi), np.sin(alpha) * np.sin(phi), np.cos(alpha)])


def _touched_rim(i: int):
    phi, w = _ray("rim", i)
    point, k = np.array(RIMS[i][0]), np.array(RIMS[i][1])
    p = w * np.linalg.norm(np.cross(point, k)) / np.linalg.norm(np.cross(w, k))
    return p, k / np.linalg.norm(k), np.array(phi)


def _touched_limb(i: int):
    phi, w = _ray("limb", i)
    center, inverse = np.array(LIMBS[i][0]), np.linalg.inv(np.array(LIMBS[i][1]))
    e, q = inverse @ w, inverse @ center
    p = w * (e @ q) / (e @ e)  # the nearest to the centre, in the ball's coordinates
    steep = inverse.T @ inverse @ (p - center)
    n = steep / np.linalg.norm(steep)
    flat = np.eye(3) - np.outer(n, n)
    return p, n, flat @ (inverse.T @ inverse) @ flat / np.linalg.norm(steep), np.array(phi)


def _each(kind):
    kinds = ("limb", "rim") if kind == "both" else (kind,)
    return [(k, i) for k in kinds for i in range(len(LIMBS if k == "limb" else RIMS))]


def _turned(gradient, phi):
    """(x, y) to (u, v)."""
    c, s = np.cos(phi), np.sin(phi)
    return np.array([c * gradient[0] + s * gradient[1], -s * gradient[0] + c * gradient[1]])


def against_bisection(kind: str, part: str) -> float:
    """Largest error of `part` ("u", "v", "x", "y", "bend") relative to the rate's size."""
    worst = 0.0
    for k, i in _each(kind):
        found, bend = ours(k, i)
        _, gradient, hessian = differences(k, i)
        worst = max(worst, _error(found, bend, gradient, hessian, part))
    return worst


def against_autodiff(kind: str, part: str) -> float:
    """The same against autodiff of the angle as a root of a quadratic, or from a plane."""
    worst = 0.0
    for k, i in _each(kind):
        gradient, hessian, _ = _differentiated(k, i)
        worst = max(worst, _error(*ours(k, i), gradient, hessian, part))
    return worst


def _differentiated(kind: str, i: int):
    return tuple(a[i] for a in _all_differentiated(kind))


@functools.cache
def _all_differentiated(kind: str):
    """Gradients, Hessians and gradients of weighed integrals, of all cases at once."""
    import jax
    import jax.numpy as jnp

    function = limb_angle if kind == "limb" else rim_angle
    t, weight = np.polynomial.legendre.leggauss(24)

    def three(*case):
        def integral(m):
            half = 0.5 * function(m, *case)
            return jnp.sum(half * weight * _weight(jnp, half * (1.0 + t)))

        still = jnp.zeros(2)
        gradient, hessian = jax.jacfwd(function)(still, *case), jax.hessian(function)(still, *case)
        return gradient, hessian, jax.jacfwd(integral)(still)

    cases = zip(*(LIMBS if kind == "limb" else RIMS), strict=True)
    args = [jnp.asarray(np.array(a)) for a in cases]
    return tuple(np.asarray(a) for a in jax.jit(jax.vmap(three))(*args))


def _error(found, bend, gradient, hessian, part) -> float:
    if part == "bend":
        return float(np.max(np.abs(bend - hessian)) / np.max(np.abs(hessian)))
    along = dict(zip("uv", _turned(gradient, float(found.phi)), strict=True))
    along |= dict(zip("xy", gradient, strict=True))
    return abs(float(getattr(found, f"alpha_{part}")) - along[part]) / np.max(np.abs(gradient))


def moved_point(i: int, route: str):
    """The rate dp for a unit step along m = (0.6, 0.8) and D', of the tangent point of a ball.

    By differences of bisected angles, or by autodiff of the closed-form angle; D from Pythagoras.
    """
    center, axes, phi, _ = LIMBS[i]
    radius = axes[0][0]

    def point(lib, alpha, t):
        gap = [center[0] - 0.6 * t, center[1] - 0.8 * t, center[2]]
        dist = lib.sqrt(gap[0] ** 2 + gap[1] ** 2 + gap[2] ** 2 - radius**2)
        s, c = lib.sin(alpha), lib.cos(alpha)
        way = [s * lib.cos(phi), s * lib.sin(phi), c]
        return [0.6 * t + dist * way[0], 0.8 * t + dist * way[1], dist * way[2]], dist

    if route == "brute":
        with mp.workdps(40):
            h, phi = STEP, mp.mpf(phi)
            sides = [
                point(mp, bisected(LIMBS[i], (mp.mpf("0.6") * t, mp.mpf("0.8") * t)), t)
                for t in (h, -h)
            ]
            rates = [(p - q) / (2 * h) for p, q in zip(sides[0][0], sides[1][0], strict=True)]
            return np.array([float(v) for v in rates]), float((sides[0][1] - sides[1][1]) / (2 * h))
    import jax
    import jax.numpy as jnp

    def both(t, alpha, turn):
        p, dist = point(jnp, alpha + turn * t, t)
        return jnp.stack([*p, dist])

    turn = _differentiated("limb", i)[0] @ [0.6, 0.8]
    found = np.asarray(jax.jacfwd(both)(0.0, differences("limb", i)[0], turn))
    return found[:3], found[3]


def motion_error(route: str, flat: bool) -> float:
    """(42), or with `flat` (43): dp - (D dalpha c + dD w + m), or dp . n, for balls."""
    worst = 0.0
    for i in (0, 1):
        found, _ = ours("limb", i)
        dp, dD = moved_point(i, route)
        alpha, phi, dist = float(found.value), float(found.phi), float(found.distance)
        e = np.array([np.cos(phi), np.sin(phi), 0.0])
        w = np.sin(alpha) * e + [0, 0, np.cos(alpha)]
        c = np.cos(alpha) * e - [0, 0, np.sin(alpha)]
        rate = 0.6 * float(found.alpha_x) + 0.8 * float(found.alpha_y)
        n = (dist * w - np.array(LIMBS[i][0])) / LIMBS[i][1][0][0]
        left = dp @ n if flat else dp - (dist * rate * c + dD * w + [0.6, 0.8, 0.0])
        worst = max(worst, float(np.max(np.abs(left))))
    return worst


def along_any(route: str) -> float:
    """(44) for m = (0.6, 0.8, 0): the rate against both routes, for balls and ellipsoids."""
    worst = 0.0
    for _, i in _each("limb"):
        found, _ = ours("limb", i)
        gradient = differences("limb", i)[1] if route == "brute" else _differentiated("limb", i)[0]
        rate = 0.6 * float(found.alpha_x) + 0.8 * float(found.alpha_y)
        worst = max(worst, float(np.abs(rate - gradient @ [0.6, 0.8])))
    return worst


def _weight(lib, t):
    return lib.cos(t) * (1.0 + 0.3 * t)


def weighed(route: str) -> float:
    """(39): d/dx of int f V dtheta against f(alpha) alpha_x."""
    worst = 0.0
    for _, i in _each("limb"):
        found, _ = ours("limb", i)
        value = float(_weight(np, float(found.value)) * found.alpha_x)
        if route == "brute":
            with mp.workdps(40):
                ends = [bisected(LIMBS[i], (s * STEP, 0)) for s in (1, -1)]
                truth = mp.quad(lambda u: _weight(mp, u), ends[::-1]) / (2 * STEP)
        else:
            truth = _differentiated("limb", i)[2][0]
        worst = max(worst, abs(value - float(truth)))
    return worst


def traced_visibility() -> float:
    """(38): H(alpha - theta) against rays, alpha the library's of the touched point.

    For angles up to the far end of the blocker, and within a hundred thousandth of the edge.
    """
    worst = 0.0
    steps = np.concatenate([np.linspace(-0.05, 0.05, 40), [-1e-5, 1e-5]])
    for _, i in _each("limb"):
        center, axes, phi, side = LIMBS[i]
        alpha = float(ours("limb", i)[0].value)
        for theta_ in alpha + steps:
            free = not ray_meets(center, axes, (0, 0, 0), phi, theta_)
            step = (alpha - theta_) * side > 0
            worst = max(worst, abs(float(free) - float(step)))
    return worst


def same_number() -> float:
    """(72) with a tangent of the silhouette against (46) with the normal, on ellipsoids.

    The tangent is found from two limbs of neighbouring slices, and so is only good to 1e-7.
    """
    import jax
    import jax.numpy as jnp

    from firstorder.visibility import crease_elevation

    limb, rim_at = jax.jit(limb_angle), jax.jit(crease_elevation)
    worst = 0.0
    for _, i in _each("limb"):
        found, _ = ours("limb", i)
        center, axes, phi, side = LIMBS[i]
        inverse = np.linalg.inv(np.array(axes))
        ends = []
        for e in (1e-5, -1e-5):
            angle = float(limb(jnp.zeros(2), jnp.asarray(center), jnp.asarray(axes), phi + e, side))
            w = [np.sin(angle) * np.cos(phi + e), np.sin(angle) * np.sin(phi + e), np.cos(angle)]
            d, q = inverse @ np.array(w), inverse @ np.array(center)
            ends.append(np.array(w) * (d @ q) / (d @ d))
        tangent, middle = ends[0] - ends[1], 0.5 * (ends[0] + ends[1])
        rim = rim_at(jnp.asarray(middle), jnp.asarray(tangent), phi)
        worst = max(worst, abs(float(rim.alpha_v / found.alpha_v) - 1.0))
    return worst


def grazing_order(case=LIMBS[0]) -> float:
    """Fitted exponent of alpha_v in phi0 - phi, less -1/2, from bisected angles and finite steps.

    phi0 of a ball is the azimuth at which its distance from the slice is its radius.
    """
    center, axes, _, side = case
    flat = np.hypot(center[0], center[1])
    phi0 = np.arctan2(center[1], center[0]) + np.arcsin(axes[0][0] / flat)
    gaps = np.array([1e-6, 1e-7, 1e-8, 1e-9])
    rates = []
    with mp.workdps(40):
        turn = mp.atan2(mp.mpf(center[1]), mp.mpf(center[0])) + mp.asin(
            mp.mpf(axes[0][0]) / mp.sqrt(mp.mpf(center[0]) ** 2 + mp.mpf(center[1]) ** 2)
        )
        for gap in gaps:
            phi = turn - mp.mpf(float(gap))
            rates.append(float(_across(center, axes[0][0], phi, side)))
    assert abs(float(turn) - phi0) < 1e-12
    return abs(float(np.polyfit(np.log(gaps), np.log(np.abs(rates)), 1)[0]) + 0.5)


def _across(center, radius, phi, side):
    """alpha_v of a ball by differences of the angle, which is found from the slice's circle."""
    h = mp.mpf(10) ** -18

    def angle(t):
        x, y = center[0] + t * mp.sin(phi), center[1] - t * mp.cos(phi)
        u, v = x * mp.cos(phi) + y * mp.sin(phi), -x * mp.sin(phi) + y * mp.cos(phi)
        cut = mp.sqrt(mp.mpf(radius) ** 2 - v**2)
        return mp.atan2(u, center[2]) - side * mp.asin(cut / mp.sqrt(u**2 + mp.mpf(center[2]) ** 2))

    return (angle(h) - angle(-h)) / (2 * h)


def grazing_value() -> float:
    """`contour_elevation` close to a grazing slice against those differences."""
    import jax.numpy as jnp

    from firstorder.visibility import contour_elevation

    center, axes, _, side = LIMBS[0]
    radius = axes[0][0]
    phi0 = np.arctan2(center[1], center[0]) + np.arcsin(radius / np.hypot(*center[:2]))
    with mp.workdps(40):
        phi = mp.mpf(phi0 - 1e-4)
        truth = float(_across(center, radius, phi, side))
        C0, S0 = mp.cos(phi), mp.sin(phi)
        u, v = center[0] * C0 + center[1] * S0, -center[0] * S0 + center[1] * C0
        cut = mp.sqrt(mp.mpf(radius) ** 2 - v**2)
        D2 = mp.sqrt(u**2 + mp.mpf(center[2]) ** 2 - cut**2)
        alpha = mp.atan2(u, center[2]) - side * mp.asin(cut / mp.sqrt(u**2 + center[2] ** 2))
        p = [D2 * mp.sin(alpha) * C0, D2 * mp.sin(alpha) * S0, D2 * mp.cos(alpha)]
        n = [(p[i] - center[i]) / radius for i in range(3)]
        p, n = (np.array([float(c) for c in a]) for a in (p, n))
    found = contour_elevation(jnp.asarray(p), jnp.asarray(n), float(phi))
    return abs(float(found.alpha_v) / truth - 1.0)
