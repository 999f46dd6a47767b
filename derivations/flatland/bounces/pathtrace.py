"""Random estimators of the rendering equation: J12 (28), (29) and, of its gradient, (39).

Each proof takes the expectation of the estimator as a sum, or integral, over everything that can be
drawn, each with its probability, and finds the integral or the Neumann series that it estimates.
"""

from __future__ import annotations

import itertools

import numpy as np
import sympy as sp

from firstorder.ledger import Check, Row, na

theta = sp.Symbol("theta", real=True)
HALF = sp.pi / 2


# --- (28) ---------------------------------------------------------------------------------------


def one_sample():
    """`E[f L cos / pdf] = int f L cos`, for the two densities of the hemicircle.

    Each density is first shown to be one: the printed 1/pi is, and cos/2; `1/(2 pi)` and cos/pi of
    space are not. The drawn number u is mapped to an angle, and the mean is taken over u.
    """
    u = sp.Symbol("u", positive=True)
    rho, a, b, c = sp.symbols("rho a b c")
    L = a + b * sp.sin(theta) + c * sp.cos(theta) ** 2
    truth = sp.integrate(rho / 2 * L * sp.cos(theta), (theta, -HALF, HALF))
    out = []
    uniform, cosine = 1 / sp.pi, sp.cos(theta) / 2
    for density in (uniform, cosine):
        out.append(sp.integrate(density, (theta, -HALF, HALF)) - 1)
        out.append(
            sp.integrate(density * (rho / 2 * L * sp.cos(theta) / density), (theta, -HALF, HALF))
            - truth
        )
    # The maps from u have these densities: dtheta/du = 1 / pdf.
    out.append(sp.diff(sp.pi * (u - sp.Rational(1, 2)), u) - 1 / uniform)
    at = sp.asin(2 * u - 1)
    out.append(sp.simplify(sp.diff(at, u) ** 2 - 1 / cosine.subs(theta, at) ** 2))
    return out


def tree_measured() -> float:
    """The library's tree, one level, against adaptive quadrature; worst z over its threshold."""
    import jax
    from scipy.integrate import quad

    from firstorder.checks.statistics import z_test_of
    from firstorder.flatland import Receiver, Scene, Segments, primitive
    from firstorder.flatland.bounces.pathtrace import tree_irradiance

    lamp = primitive(Segments((0.9, 1.0), (-0.4, 0.7)), emission=1.3)
    ends = np.arctan2([-(0.9 - 0.2), 0.4 + 0.2], [1.0, 0.7])
    truth = 1.3 * quad(np.cos, *ends)[0]
    at = Receiver(np.array([[0.2, 0.0]]), np.zeros(1), np.array([-1]))
    z = z_test_of(
        tree_irradiance(Scene.of(lamp), at, key=jax.random.key(1), branches=(16,), runs=2000), truth
    )
    return z.worst / z.threshold


def densities_by_autodiff() -> float:
    """Each sampler's density against the derivative of its map: `pdf(theta(u)) dtheta/du = 1`."""
    import jax

    from firstorder.sampling import CosineDirections, UniformDirections

    u = np.linspace(0.03, 0.97, 7)
    worst = 0.0
    for sampler in (UniformDirections(), CosineDirections()):
        rate = jax.vmap(jax.grad(sampler.sample))(u)
        off = np.asarray(rate * sampler.density(sampler.sample(u))) - 1.0
        worst = max(worst, float(np.max(np.abs(off))))
    return worst


# --- (29) ---------------------------------------------------------------------------------------


K = sp.Matrix(2, 2, sp.symbols("K00 K01 K10 K11"))
EMITTED = sp.Matrix(sp.symbols("e0 e1"))
GO = sp.Symbol("q")  # the chance to go on
p0, p1 = sp.symbols("p0 p1")
P = sp.Matrix([[p0, 1 - p0], [p1, 1 - p1]])  # chances of the next patch


def drawn(path, chance, longest):
    """Every path that a walk may take after these patches, with its chance: step by step.

    A walk is past its first bounce before it may end, so that no path has the light that (29) adds.
    """
    bounced = len(path) > 1
    if bounced:
        yield path, chance * (1 - GO)
    if len(path) <= longest:
        for step in (0, 1):
            further = chance * (GO if bounced else 1) * P[path[-1], step]
            yield from drawn((*path, step), further, longest)


def printed_sample(path):
    """`L^i` and `pdf_i` of (29), from the patches and the length of a path alone."""
    steps = list(itertools.pairwise(path))
    light = sp.prod([K[s] for s in steps]) * EMITTED[path[-1]]
    return light, sp.prod([P[s] for s in steps]) * GO ** (len(steps) - 1) * (1 - GO)


def all_paths(longest=3):
    """Two patches with any transport matrix K: (29)'s mean, `e` and all paths, solves L = e + K L.

    So it does up to paths that are longer than the longest; and `pdf_i` is a density: with the
    chance `q^longest` of those it adds up to one. The printed L^i counts the light at its end
    alone, so `pdf_i` has the chance 1 - q to end there; and paths have a bounce or more (M >= 2).
    """
    total, mean = 0, EMITTED[:]
    for start in (0, 1):
        for path, chance in drawn((start,), 1, longest):
            light, pdf = printed_sample(path)
            mean[start] += chance * light / pdf
            total += pdf if start == 0 else 0
    L = sp.Matrix(mean).applyfunc(sp.cancel)
    rest = L - EMITTED - K * L + K ** (longest + 1) * EMITTED
    return [*rest.applyfunc(sp.expand), sp.expand(total - 1 + GO**longest)]


def furnace_series():
    """All lengths, where everything shines and reflects alike: L = e + rho L, from e and all paths.

    With light gathered at every vertex (partial sums) too: what is gathered at the n-th is divided
    by the chance to come so far, which is that of all walks that end there or later. If the chance
    of the length is left out of `pdf_i`, the paths bring too little, by a factor that is named.
    """
    rho, q, e = sp.symbols("rho q e", positive=True)
    m, n = sp.symbols("m n", integer=True, positive=True)

    def total(term, k, first=1):
        ratio = sp.simplify(term.subs(k, k + 1) / term)
        return sp.simplify(term.subs(k, first) / (1 - ratio))  # geometric

    ends = q ** (m - 1) * (1 - q)  # the chance of m bounces
    at_end = total(rho**m * e, m)
    at_every = total(total(ends, m, n) * rho**n * e / q ** (n - 1), n)
    without = total(ends * rho**m * e, m)
    solves = [paths - rho * (e + paths) for paths in (at_end, at_every)]
    return [*solves, without - at_end * (1 - q) * (1 - rho) / (1 - q * rho)]


def paths_measured() -> float:
    """The library in a furnace of 0.4 and albedo 0.5; worst z over its threshold."""
    import jax

    from firstorder.checks.statistics import z_test_of
    from firstorder.flatland import Receiver, Scene, box, primitive
    from firstorder.flatland.bounces.pathtrace import path_irradiance

    room = Scene.of(primitive(box((0.0, 0.0), (1.0, 1.0), inward=True), emission=0.4, albedo=0.5))
    at = Receiver(np.array([[0.3, 0.0], [0.9, 0.4]]), np.array([0.0, 1.0]), np.array([0, -1]))
    z = z_test_of(
        path_irradiance(room, at, key=jax.random.key(2), paths=20_000), 2 * 0.4 / (1 - 0.5)
    )
    return z.worst / z.threshold


def steps_by_autodiff() -> float:
    """A path's density is a product over its steps: each step's against its map's derivative.

    And what a step weighs is `f cos` over that density.
    """
    import jax
    import jax.numpy as jnp

    from firstorder.flatland.bounces._scatter import Surface, reflect, scatter

    rho, zero = jnp.asarray(0.6), jnp.asarray(0.0)
    surface = Surface(rho, zero, zero, zero, zero)
    out = jnp.sin(jnp.asarray(0.4)), jnp.cos(jnp.asarray(0.4))

    def turned(u):
        return scatter(surface, out, jnp.stack([0.2 * u / u, u, 0.5 * u / u]))

    def angle(u):
        return jnp.arctan2(turned(u).sine, turned(u).cosine)

    off = []
    for u in jnp.linspace(0.05, 0.95, 5):
        step = turned(u)
        f, _ = reflect(surface, out, step.sine, step.cosine)
        off += [jax.grad(angle)(u) * step.density - 1.0, step.weight * step.density - f]
    return float(np.max(np.abs(np.array(off))))  # NaN stays NaN


# --- (39) ---------------------------------------------------------------------------------------


def gradient_sample():
    """`E[L V grad G / pdf(y)]`, an integral over the drawn number u, is what the lamp's ends give.

    A lamp y = h that is all seen, L = 1. Its points t are drawn evenly, or by the angle at x:
    evenly, or as its cosine. Then u is linear in t, the angle or its sine, and the density of arc
    length is `pdf(y) = pdf(theta) cos_y / r`. Of the sample times du/dt a primitive over t is -G,
    which gives G at one end less G at the other; and the same is one of (37)'s own integrand.
    """
    x, t, lo = sp.symbols("x t lo", real=True)
    h, width = sp.symbols("h width", positive=True)
    r = sp.sqrt((t - x) ** 2 + h**2)
    G = h * h / r**3  # both cosines over r
    dG, cos_x, per_radian = G.diff(x), h / r, h / r**2  # the last is cos_y / r
    ways = (
        (t, 1 / width),
        (sp.atan((t - x) / h), per_radian / width),
        ((t - x) / r, cos_x * per_radian / width),
    )
    means = [dG / pdf * ((k - lo) / width).diff(t) + G.diff(t) for k, pdf in ways]
    return [sp.simplify(e) for e in (*means, dG + G.diff(t))]


def gradient_measured() -> float:
    """The library's sampled form against sines differentiated by hand; z over its threshold."""
    import jax

    from firstorder.checks.statistics import z_test
    from firstorder.flatland import Receiver, Scene, Segments, primitive
    from firstorder.flatland.estimators._irradiance_forms import arc_length_estimate_on_curves

    scene = Scene.of(primitive(Segments((0.5, 1.0), (-0.5, 1.0)), emission=1.3))
    x, runs = 0.3, 200
    at = Receiver(np.array([x, 0.0]), np.array(0.0), np.array(-1))
    seen = jax.jit(
        jax.vmap(
            lambda key: (
                arc_length_estimate_on_curves(scene, at, count=16, key=key).translation().first
            )
        )
    )(jax.random.split(jax.random.key(4), runs))
    truth = 1.3 * (1.0 / np.hypot(1.0, -0.5 - x) ** 3 - 1.0 / np.hypot(1.0, 0.5 - x) ** 3)
    seen = np.asarray(seen)
    z = z_test(seen.mean(), seen.std(ddof=1) / np.sqrt(runs), truth, freedom=runs - 1)
    return z.worst / z.threshold


def gradient_by_autodiff() -> float:
    """The mean over many strata against autodiff of the angle that the lamp subtends."""
    import jax
    import jax.numpy as jnp

    from firstorder.flatland import Receiver, Scene, Segments, primitive
    from firstorder.flatland.estimators._irradiance_forms import arc_length_estimate_on_curves

    def subtended(x):
        return 1.3 * (jnp.sin(jnp.arctan(0.5 - x)) + jnp.sin(jnp.arctan(0.5 + x)))

    scene = Scene.of(primitive(Segments((0.5, 1.0), (-0.5, 1.0)), emission=1.3))
    at = Receiver(np.array([0.3, 0.0]), np.array(0.0), np.array(-1))
    middle = jax.jit(
        lambda: arc_length_estimate_on_curves(scene, at, count=4000).translation().first
    )()
    return float(abs(middle / jax.grad(subtended)(0.3) - 1.0))


ROWS = [
    Row(
        "J12.28",
        "identity",
        implements="firstorder.flatland.bounces.pathtrace.tree_irradiance",
        symbolic=one_sample,
        autodiff=Check(densities_by_autodiff, 1e-13),
        fourier=na("no spectrum"),
        brute_force=Check(tree_measured, 1.0),
        note="Unbiased at any N; a recursion cut off at a depth loses light reflected more often.",
    ),
    Row(
        "J12.29",
        "identity",
        implements="firstorder.flatland.bounces.pathtrace.path_irradiance",
        symbolic=lambda: [*all_paths(), *furnace_series()],
        autodiff=Check(steps_by_autodiff, 1e-13),
        fourier=na("no spectrum"),
        brute_force=Check(paths_measured, 1.0),
        note="Paths have a bounce at least (M >= 2): with M = 1 their light is the emission that "
        "(29) adds. pdf_i is the product of the densities per radian and of the chance of the "
        "length: without the latter the paths bring too little, by (1 - q)(1 - rho) / (1 - q rho) "
        "in a furnace. With light gathered at every vertex the chance to have come so far takes "
        "its place.",
    ),
    Row(
        "J12.39",
        "identity",
        implements="firstorder.flatland.estimators._irradiance_forms.arc_length_estimate_on_curves",
        symbolic=gradient_sample,
        autodiff=Check(gradient_by_autodiff, 1e-6),
        fourier=na("no spectrum"),
        brute_force=Check(gradient_measured, 1.0),
        note="An estimator of (37), and of the gradient itself only where no shadow edge moves. By "
        "angle, pdf(y) = pdf(theta) cos_y / r, whose variance is infinite before curved limbs.",
    ),
]
