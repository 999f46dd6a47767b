"""What the derivation of `forms` measures: the library's forms against `_scenes` with 30 digits."""

from __future__ import annotations

import functools

import numpy as np

from derivations.flatland import _scenes as scenes

HERE = {"A": ((0.35, 0.0), 0.2), "B": ((0.35, 0.0), 0.2), "disc": ((0.35, 0.02), 0.2)}


@functools.cache
def truth(name):
    return scenes.motion(name, *HERE[name])


@functools.cache
def compiled(name, form, n=0):
    """One of the library's forms in one scene."""
    import equinox as eqx

    from firstorder.flatland import Receiver, derivatives, irradiance
    from firstorder.flatland.estimators._irradiance_forms import (
        arc_length_integral,
        stratified_estimate,
    )
    from firstorder.flatland.estimators.strata import hemicircle_strata, trace_strata

    scene, radiance = scenes.built(name)
    at = Receiver(*HERE[name])
    forms = {
        "exact": lambda key: arc_length_integral(scene, at, radiance=radiance),
        "stratified": lambda key: stratified_estimate(
            trace_strata(scene, at, where=hemicircle_strata(n), radiance=radiance)
        ),
        "autodiff": lambda key: derivatives(
            lambda r: irradiance(scene, r, radiance=radiance), at, freedoms=("x",)
        ),
    }
    import jax

    return eqx.filter_jit(forms[form])(jax.random.key(1))


def frozen_error(order) -> float:
    """The arc-length integral in scene A, by all three freedoms."""
    from firstorder.checks.tolerance import normwise

    ours = compiled("A", "exact")
    return normwise((ours.value, ours.gradient, ours.hessian)[order], truth("A")[order])


def frozen_autodiff(order) -> float:
    ours, right = compiled("A", "exact").translation(), compiled("A", "autodiff")
    return float(abs((ours.first - right.first, ours.second - right.second)[order - 1]))


def with_boundary() -> float:
    """(36) in scene B: the arc-length gradient and the two edges, against the truth."""
    (px, _), n = HERE["B"]
    _, gradient, _ = truth("B")
    step = np.array([np.cos(n), np.sin(n)])
    edges = 0.0
    for end, side in zip(scenes.BLOCKER, (-1.0, 1.0), strict=True):
        # The shadow of the end is at s = 2 end - px when the receiver is on the floor.
        s = 2.0 * end - px
        if not scenes.LIGHT[0] < s < scenes.LIGHT[1]:
            continue
        # s(px, py) = px + (end - px)(1 - py) / (0.5 - py): its slopes at py = 0.
        slope = np.array([-1.0, (end - px) * (1 / 0.25 - 1 / 0.5)])
        p = np.array([s - px, 1.0])
        G = (np.array([-np.sin(n), np.cos(n)]) @ p) * p[1] / np.linalg.norm(p) ** 3
        edges += -side * G * (slope @ step)  # lit from s on, on the far side of the blocker
    return float(abs(compiled("B", "exact").gradient[0] + edges - gradient[0]))


def angular() -> float:
    """(40): the library's E in scene B against 30 digits."""
    return float(abs(compiled("B", "exact").value - truth("B")[0]))


def sector_sums() -> float:
    """(43) and (44) with numbers, and the library's sum of borders, for uneven strata."""
    from firstorder.flatland.estimators._irradiance_forms import border_derivatives
    from firstorder.visibility import edge_at

    rng = np.random.default_rng(4)
    ends = np.sort(np.r_[-np.pi / 2, rng.uniform(-1.5, 1.5, 30), np.pi / 2])
    L = rng.uniform(0.0, 2.0, 31)
    direct = sum(v * (np.sin(q) - np.sin(p)) for v, p, q in zip(L, ends, ends[1:], strict=False))
    jump = np.r_[0.0, L] - np.r_[L, 0.0]
    zero = np.zeros_like(ends)
    ours = border_derivatives(edge_at(ends, zero, jump, zero)).value
    return max(abs(np.sum(jump * np.sin(ends)) - direct), float(abs(ours - direct)))


def constant_per_sector() -> float:
    """(42): departure of the fitted order of the midpoint sum from -2, for a smooth light."""
    from firstorder.checks.tolerance import fitted_order
    from firstorder.flatland.estimators._irradiance_forms import border_derivatives
    from firstorder.visibility import edge_at

    def light(t):
        return np.exp(np.sin(2 * t))

    t, w = np.polynomial.legendre.leggauss(60)
    right = np.sum(np.pi / 2 * w * light(np.pi / 2 * t) * np.cos(np.pi / 2 * t))
    sizes, errors = np.array([50, 100, 200, 400]), []
    for n in sizes:
        ends = np.linspace(-np.pi / 2, np.pi / 2, n + 1)
        L, zero = light(0.5 * (ends[1:] + ends[:-1])), np.zeros_like(ends)
        borders = edge_at(ends, zero, np.r_[0.0, L] - np.r_[L, 0.0], zero)
        errors.append(float(abs(border_derivatives(borders).value - right)))
    return abs(fitted_order(sizes, errors) + 2.0)


def points_moved(order) -> float:
    """`border_derivatives` against autodiff of the sines of fixed points, by all three freedoms."""
    import jax
    import jax.numpy as jnp

    from firstorder.checks.tolerance import normwise
    from firstorder.flatland.estimators._irradiance_forms import border_derivatives
    from firstorder.visibility import edge_at

    rng = np.random.default_rng(7)
    angle, r, jump = rng.uniform(-1.4, 1.4, 9), rng.uniform(0.3, 3.0, 9), rng.normal(size=9)
    points = r[:, None] * np.stack([-np.sin(angle), np.cos(angle)], -1)

    def total(q):
        p = points - q[:2]
        side = p[:, 0] * jnp.cos(q[2]) + p[:, 1] * jnp.sin(q[2])
        return jnp.sum(-jump * side / jnp.sqrt(jnp.sum(p * p, -1)))

    ours = border_derivatives(edge_at(angle, 1.0 / r, jump, 0.0 * r))
    if order == 1:
        return normwise(ours.gradient, jax.jit(jax.grad(total))(jnp.zeros(3)))
    return normwise(ours.hessian, jax.jit(jax.hessian(total))(jnp.zeros(3)))


def limbs_moved() -> float:
    """`border_derivatives` with its bend against autodiff of the sines of a disc's two tangents."""
    import jax
    import jax.numpy as jnp

    from firstorder.checks.tolerance import normwise
    from firstorder.flatland.estimators._irradiance_forms import border_derivatives
    from firstorder.visibility import edge_at

    centre, radius, sides = jnp.array([-0.3, 0.9]), 0.35, jnp.array([1.0, -1.0])

    def limb(q):
        p = centre - q[:2]
        D = jnp.sqrt(p @ p)
        return jnp.arctan2(-p[0], p[1]) + sides * jnp.arcsin(radius / D) - q[2]

    jump, zero = jnp.array([0.7, -0.4]), jnp.zeros(3)
    r = np.sqrt(float(centre @ centre) - radius**2)
    inverse = jnp.full(2, 1.0 / r)
    ours = border_derivatives(edge_at(limb(zero), inverse, jump, sides * radius / r**3))
    return normwise(
        ours.hessian, jax.jit(jax.hessian(lambda q: jnp.sum(jump * jnp.sin(limb(q)))))(zero)
    )


def gradient_error(name) -> float:
    """(47) with 16384 strata."""
    from firstorder.checks.tolerance import normwise

    return normwise(compiled(name, "stratified", 16384).gradient, truth(name)[1])


def disc_borders(n=20000):
    """The disc before the wall as borders, from plane geometry: strata of the wall, and two limbs.

    Returns them with the slope of the radiance behind each limb by the local angle.
    """
    (px, py), turn = HERE["disc"]
    d = np.subtract(scenes.CENTRE, (px, py))
    D, middle = np.hypot(*d), np.arctan2(-d[0], d[1]) - turn
    half, t = np.arcsin(scenes.RADIUS / D), np.sqrt(D**2 - scenes.RADIUS**2)
    limbs = middle + half * np.array([-1.0, 1.0])
    ends = [np.arctan2(-(p - px), 1.0 - py) - turn for p in scenes.WALL]

    def light(a):
        return scenes.LEVEL + scenes.RISE * (px - (1.0 - py) * np.tan(a + turn))

    def reach(a):
        return (1.0 - py) / np.cos(a + turn)

    pieces = [(ends[1], limbs[0]), (limbs[1], ends[0])]
    angle, inverse, jump, bend = [], [], [], []
    for low, high in pieces:
        inner = low + (high - low) * np.arange(1, n) / n
        samples = np.r_[light(low), light(low + (high - low) * (np.arange(n) + 0.5) / n)]
        samples = np.r_[samples, light(high)]
        angle += [inner, [low, high]]
        inverse += [1.0 / reach(inner), [1.0 / reach(low), 1.0 / reach(high)]]
        jump += [samples[1:-2] - samples[2:-1], [-samples[1], samples[-2]]]
        bend += [np.zeros(n - 1), np.zeros(2)]
    angle, inverse, jump, bend = map(np.concatenate, (angle, inverse, jump, bend))
    for limb, side in zip(limbs, (-1.0, 1.0), strict=True):
        k = np.flatnonzero(angle == limb)
        inverse[k], bend[k] = 1.0 / t, side * scenes.RADIUS / t**3
    slope = -scenes.RISE * (1.0 - py) / np.cos(limbs + turn) ** 2
    drag = np.array([1.0, -1.0]) * slope * np.cos(limbs) * (1.0 / t - 1.0 / reach(limbs)) ** 2
    return (angle, inverse, jump, bend), limbs, drag


def mended_sum() -> float:
    """(51) with both terms that it lacks, against the truth."""
    from firstorder.checks.tolerance import normwise
    from firstorder.flatland.estimators._irradiance_forms import border_derivatives
    from firstorder.visibility import edge_at

    borders, limbs, drag = disc_borders()
    e = np.stack([np.cos(limbs), np.sin(limbs)], -1)
    hessian = np.array(border_derivatives(edge_at(*borders)).hessian)
    hessian[:2, :2] += np.einsum("k,ki,kj->ij", drag, e, e)
    return normwise(hessian, truth("disc")[2])


def corrected_error() -> float:
    """The library's corrected estimate before the disc, from 4096 rays, against the truth."""
    import jax

    from firstorder.checks.tolerance import normwise
    from firstorder.flatland import Receiver
    from firstorder.flatland.estimators.corrected import corrected_estimate
    from firstorder.flatland.estimators.strata import hemicircle_strata, trace_strata

    scene, radiance = scenes.built("disc")
    at = Receiver(*HERE["disc"])

    @jax.jit
    def run():
        seen = trace_strata(scene, at, where=hemicircle_strata(4096), radiance=radiance)
        return corrected_estimate(scene, at, samples=seen, radiance=radiance, breaks=8)

    ours, (_, gradient, hessian) = run(), truth("disc")
    return max(normwise(ours.gradient, gradient), normwise(ours.hessian, hessian))


def printed_gradient(x):
    """(37) read literally, `dOmega`: the integral of `L V dG/dx` over the angle, in scene A."""
    theta = np.linspace(np.arctan(-0.5 - x), np.arctan(0.5 - x), 20001)
    r = 1.0 / np.cos(theta)
    p = np.stack([np.sin(theta), np.cos(theta)], -1) * r[:, None]
    c = np.cos(theta)
    gradient = (3 * c * c / r**3)[:, None] * p - (c / r**2)[:, None] * np.array([0.0, 1.0])
    gradient = gradient - (c / r**2)[:, None] * np.array([0.0, 1.0])
    return float(np.trapezoid(gradient[:, 0], theta))


def printed_hessian(x):
    """(50) as printed, in scene A: two borders, each with `H sin` by central differences."""

    def second(p, step=1e-4):
        s = [(p - q) / np.hypot(p - q, 1.0) for q in (x - step, x, x + step)]
        return (s[0] - 2 * s[1] + s[2]) / step**2

    low, high = scenes.LIGHT
    return float((1.0 - 0.0) * second(low) + (0.0 - 1.0) * second(high))


def true_first(x):
    return float(scenes.motion("A", (x, 0.0), 0.0)[1][0])


def true_second(x):
    return float(scenes.motion("A", (x, 0.0), 0.0)[2][0, 0])


def printed_limit(x):
    """The limit of (51) before the disc: all borders as fixed points, background held constant.

    The receiver is that of `HERE`, tilted, and x its place along the floor.
    """
    import jax.numpy as jnp

    from firstorder.flatland.estimators._irradiance_forms import border_derivatives
    from firstorder.visibility import edge_at

    assert x == HERE["disc"][0][0]
    (angle, inverse, jump, bend), *_ = disc_borders()
    fixed = [jnp.asarray(a) for a in (angle, inverse, jump, 0.0 * bend)]
    return float(border_derivatives(edge_at(*fixed)).hessian[0, 0])
