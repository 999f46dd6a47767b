"""Sampling rates off a curved glossy mirror, from the geometry of a reflection (D05 §6.2, Fig. 15).

Signs, proofs and rays are those of `bandwidth`, whose band limits arrive here at the eye.
"""

from __future__ import annotations

import numpy as np

from derivations.bandwidth._bandwidth_proofs import (
    at_the_eye,
    edge_per_eye,
    edge_slope,
    mean_is_below_the_largest,
    mirror_in_space,
    mirrored_per_eye,
)
from derivations.bandwidth._bandwidth_spectra import extent_error, peak_error
from derivations.bandwidth._bandwidth_steps import step_error
from derivations.reconstruction import tracer
from firstorder.checks.tolerance import normwise
from firstorder.ledger import Check, Counterexample, Row, na

# --- numbers, from rays ------------------------------------------------------------------------


def _ours(function, *arguments):
    """A function of the library on NumPy arrays."""
    return np.asarray(function(*map(np.asarray, arguments)))


def glossy_by_rays() -> float:
    """Largest relative error of `glossy_bandwidth` against rays and against the sine rule."""
    from firstorder.bandwidth import glossy_bandwidth

    d, k, theta = tracer.configurations(4000, seed=1)
    ours = _ours(glossy_bandwidth, 1.0, d, k, np.cos(theta))
    scale = 1.0 + 2.0 * np.abs(k) * d / np.cos(theta)  # beside it the focus is a difference
    others = tracer.traced_frequency(d, k, theta), tracer.chord_frequency(d, k, theta)
    return float(max(np.max(np.abs(ours - other) / scale) for other in others))


def occluded_by_rays() -> float:
    """Largest relative error of `occluded_bandwidth` against rays past an edge."""
    from firstorder.bandwidth import occluded_bandwidth

    d, k, theta, depth, at = edges(4000, seed=2)
    light = 0.7
    ours = _ours(
        occluded_bandwidth, 1.0, d, k, np.cos(theta), depth, np.cos(at), light
    )  # fmt: skip
    blur, wander = np.abs(tracer.traced_edge(d, k, theta, depth, at))
    scale = 1.0 + 2.0 * np.abs(k) * d / np.cos(theta) + 2.0 * wander
    return float(np.max(np.abs(ours - blur - light * wander) / scale))


def edges(count: int, seed: int):
    """Configurations of an eye, a mirror and an edge somewhere before it."""
    rng = np.random.default_rng(seed)
    at = rng.uniform(-1.0, 1.0, count) * np.deg2rad(85.0)
    return *tracer.configurations(count, seed), 10.0 ** rng.uniform(-2, 2, count), at


def _jax_angles(d, k, theta, depth, at):
    """Mirrored angle and edge's angle as jittable functions of the eye's angle."""
    import jax.numpy as jnp

    def direction(a):
        return jnp.stack([-jnp.sin(a), jnp.cos(a)])

    def angles(psi):
        E, w = d * direction(theta), -direction(psi)
        N = jnp.stack([-k * E[0], 1.0 - k * E[1]])
        sin_i = w[0] * N[1] - w[1] * N[0]
        P = E + w * (2.0 * E[1] - k * jnp.sum(E * E)) / (jnp.sqrt(1.0 - sin_i**2) - jnp.sum(w * N))
        n = jnp.arctan2(k * P[0], 1.0 - k * P[1])
        to_edge = depth * direction(at) - P
        mirrored = 2.0 * n - psi
        edge = jnp.arctan2(-to_edge[0], to_edge[1])
        return jnp.stack([mirrored, mirrored - edge, edge])

    return angles


def by_autodiff(blocked: bool) -> float:
    """Bandwidths against `jax.jacfwd` of an exact ray, |kappa| d up to 30."""
    import jax
    import jax.numpy as jnp

    from firstorder.bandwidth import glossy_bandwidth, occluded_bandwidth

    rng = np.random.default_rng(4)
    n = 500
    d, depth = 10.0 ** rng.uniform(-1, 0.5, (2, n))
    k = rng.choice([-1.0, 1.0], n) * 10.0 ** rng.uniform(-1, 1, n)
    theta, at = rng.uniform(-1.2, 1.2, (2, n))
    rates = jax.jit(jax.vmap(lambda *a: jax.jacfwd(_jax_angles(*a))(a[2])))
    mirrored, apart, edge = np.abs(np.asarray(rates(*map(jnp.asarray, (d, k, theta, depth, at))))).T
    if not blocked:
        return normwise(_ours(glossy_bandwidth, 1.0, d, k, np.cos(theta)), mirrored)
    arguments = 1.0, d, k, np.cos(theta), depth, np.cos(at), 0.7
    return normwise(_ours(occluded_bandwidth, *arguments), apart + 0.7 * edge)


# --- what the criteria are worth ---------------------------------------------------------------


def _scalar(function, *arguments) -> float:
    return float(np.asarray(function(*arguments)))


def printed_glossy(cutoff, d, kappa, theta):
    """D05 (20)."""
    from firstorder.bandwidth import glossy_criterion

    return _scalar(glossy_criterion, cutoff, d, kappa, np.cos(theta))


def traced_glossy(cutoff, d, kappa, theta):
    """What the eye sees, by tracing."""
    return cutoff * float(tracer.traced_frequency(d, kappa, theta))


def scale_error() -> float:
    """The corrected condition: true over printed is |t -+ 1| / t, t = 2 |k| d / (n . v).

    Both of the rays and of the library's bandwidth over its own printed criterion.
    """
    from firstorder.bandwidth import glossy_bandwidth, glossy_criterion

    d, k, theta = tracer.configurations(1000, seed=7)
    t = 2.0 * np.abs(k) * d / np.cos(theta)
    traced = tracer.traced_frequency(d, k, theta) / t
    ours, printed = (
        _ours(f, 1.0, d, k, np.cos(theta)) for f in (glossy_bandwidth, glossy_criterion)
    )
    worst = [
        np.abs(traced - of) / (1.0 + 1.0 / t)
        for of in (np.abs(1.0 - np.sign(k) / t), ours / printed)
    ]
    return float(np.max(worst))


def several_blockers() -> float:
    """With several edges the largest of the bandwidths is that of the largest cos / depth."""
    from firstorder.bandwidth import occluded_bandwidth

    rng = np.random.default_rng(8)
    depths = 10.0 ** rng.uniform(-1, 1, (50, 4))
    views = [np.full(50, value) for value in (1.0, -0.4, 0.3)]
    traced = [np.abs(tracer.traced_edge(*views, depth, -views[2])[0]) for depth in depths.T]
    ours = _ours(occluded_bandwidth, 1.0, 1.0, -0.4, np.cos(0.3), np.min(depths, axis=1))
    return normwise(ours, np.max(traced, axis=0))


def space_error() -> float:
    """`glossy_bandwidth_in_space` against rays off a quadric, traced by Newton steps."""
    import jax
    import jax.numpy as jnp

    from firstorder.bandwidth import glossy_bandwidth_in_space

    rng = np.random.default_rng(6)
    a, b, e = rng.uniform(-1.0, 1.0, (3, 40))
    S = np.stack([np.stack([a, b], -1), np.stack([b, e], -1)], -1)
    d, theta = rng.uniform(0.1, 2.0, 40), rng.uniform(0.0, 1.2, 40)
    ours = jax.vmap(lambda d, S, c: glossy_bandwidth_in_space(1.0, d, S, c))
    return normwise(ours(*map(jnp.asarray, (d, S, np.cos(theta)))), [
        tracer.traced_frequency_in_space(*each) for each in zip(d, S, theta, strict=True)
    ])  # fmt: skip


def printed_wander(depth, theta):
    """Slope of a blocker's line as printed, 1 / d'; `theta` is not in it."""
    return 1.0 / depth


def traced_wander(depth, theta):
    """Angle by which an edge wanders per metre of a flat receiver, by differences."""
    edge = tracer.eye(depth, theta)

    def at(x):
        return tracer.angle(edge - np.stack([x, 0.0 * x], -1))

    return float(tracer.rate(at, np.array(0.0), 0.01 * depth * np.cos(theta)))


# --- rows --------------------------------------------------------------------------------------

ROWS = [
    Row(
        "D05.s6.2e",
        "misprint",
        implements="firstorder.bandwidth.curved_mirror.glossy_bandwidth",
        symbolic=at_the_eye,
        autodiff=Check(lambda: by_autodiff(blocked=False), 1e-10),
        fourier=Check(peak_error, 2e-3),
        brute_force=Check(lambda: step_error("eye"), 1e-7),
        corrected="(-(2 k / cos(theta_1)) Omega_rho, Omega_rho + d (2 k / cos(theta_1)) Omega_rho)",
        counterexample=Counterexample(
            {"d": 1.0, "k": 1.0, "theta_1": 0.6},
            lambda d, k, theta_1: abs(1.0 - 2.0 * k * d / np.cos(theta_1)),
            lambda d, k, theta_1: float(tracer.traced_frequency(d, -k, theta_1)),
        ),
        note="A bump (k > 0 in D05) spreads light; with the printed sign it would have a focus. "
        "Fourier: stated error of a window of 1 mrad.",
    ),
    Row(
        "D05.s6.2f",
        "over-claim",
        implements="firstorder.bandwidth.curved_mirror.glossy_bandwidth",
        symbolic=mirrored_per_eye,
        autodiff=na("measured"),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: scale_error(), 1e-6),
        corrected="2 |k| d / (n . v) >> 1",
        counterexample=Counterexample(
            {"cutoff": 1.0, "d": 1000.0, "kappa": -1e-5, "theta": 0.0},
            printed_glossy,
            traced_glossy,
        ),
        note="d has a unit: in any scene it is large in micrometres. Counted: the printed value is "
        "within 10 % where 2 |k| d / (n . v) >= 9 on bumps, >= 11 in valleys.",
    ),
    Row(
        "D05.20",
        "over-claim",
        implements="firstorder.bandwidth.curved_mirror.glossy_bandwidth",
        symbolic=mirrored_per_eye,
        autodiff=Check(lambda: by_autodiff(blocked=False), 1e-10),
        fourier=Check(peak_error, 2e-3),
        brute_force=Check(glossy_by_rays, 1e-6),
        corrected="B = |1 + 2 k d / (n . v)| Omega_rho  (k > 0 a bump; <= (1 + 2 |k| d / (n . v)) "
        "Omega_rho)",
        counterexample=Counterexample(
            {"cutoff": 3.0, "d": 1.0, "kappa": -0.5, "theta": 0.0}, printed_glossy, traced_glossy
        ),
        note="Not a bound: too small for every bump, by Omega_rho exactly; 0 for a flat mirror, "
        "which shows Omega_rho. In a valley too large without limit at the focus "
        "2 |k| d = n . v, where the eye sees nothing change.",
    ),
    Row(
        "D05.s6.2g",
        "over-claim",
        implements="firstorder.bandwidth.curved_mirror.occluded_bandwidth",
        symbolic=edge_slope,
        autodiff=Check(lambda: by_autodiff(blocked=True), 1e-10),
        fourier=Check(extent_error, 5e-3),
        brute_force=Check(occluded_by_rays, 1e-6),
        corrected="O_x = (cos(theta_0) / d') O_theta",
        counterexample=Counterexample(
            {"depth": 0.5, "theta": np.pi / 3}, printed_wander, traced_wander
        ),
        note="d' along the ray. Content at all frequencies is the worst case of the blocker alone: "
        "what it cuts adds its own band (D05.21).",
    ),
    Row(
        "D05.21",
        "over-claim",
        implements="firstorder.bandwidth.curved_mirror.occluded_bandwidth",
        symbolic=edge_per_eye,
        autodiff=Check(lambda: by_autodiff(blocked=True), 1e-10),
        fourier=Check(extent_error, 5e-3),
        brute_force=Check(occluded_by_rays, 1e-6),
        corrected="B' = |1 + (d / (n . v)) (cos(theta_0) / d' + 2 k)| Omega_rho + (d / (n . v)) "
        "(cos(theta_0) / d') Omega_L, Omega_L the band of the light that is cut",
        counterexample=Counterexample(
            {"cutoff": 3.0, "d": 1.0, "kappa": -0.5, "theta": 0.0, "depth": 2.0},
            lambda cutoff, d, kappa, theta, depth: (
                cutoff * d / np.cos(theta) * (1.0 / depth + 2.0 * abs(kappa))
            ),
            lambda cutoff, d, kappa, theta, depth: (
                cutoff * abs(float(tracer.traced_edge(d, kappa, theta, depth, -theta)[0]))
            ),
        ),
        note="Not a bound: the 1 is missing, and the band of what is cut: behind an edge a small "
        "lamp's shadow stays sharp on the dullest surface. At grazing angles too large, "
        "by up to 1 / (n . v), for in the mirror direction cos(theta_0) = n . v.",
    ),
    Row(
        "D05.s6.2h",
        "over-claim",
        implements="firstorder.bandwidth.curved_mirror.occluded_bandwidth",
        symbolic=mean_is_below_the_largest,
        autodiff=na("measured"),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: several_blockers(), 1e-6),
        corrected="1/d' = max of 1/d_i'",
        counterexample=Counterexample(
            {"near": 0.1, "far": 10.0},
            lambda near, far: 0.5 * (1.0 / near + 1.0 / far),
            lambda near, far: max(traced_wander(near, 0.0), traced_wander(far, 0.0)),
        ),
        note="A mean weighs; it does not bound. The nearest edge sets the band.",
    ),
    Row(
        "D05.s6.2i",
        "approximation",
        implements="firstorder.bandwidth.curved_mirror.glossy_bandwidth_in_space",
        symbolic=mirror_in_space,
        autodiff=na("one route"),
        fourier=na("one route"),
        brute_force=Check(space_error, 1e-6),
        corrected="B = |I + 2 d (k_11 / c, k_12; k_12, k_22 c)| Omega_rho, c = n . v "
        "(<= (1 + 2 d max|k| / c) Omega_rho)",
        counterexample=Counterexample(
            {"d": 1.0, "across": 5.0, "theta": 1.37},
            lambda d, across, theta: 2.0 * d * across / np.cos(theta),
            lambda d, across, theta: tracer.traced_frequency_in_space(
                d, np.diag([0.0, -across]), theta
            ),
        ),
        note="A practice, and said to be one. Across the plane of incidence the footprint is not "
        "stretched and the mirror turns light by 2 cos: seen aslant a cylinder gives c, not 1 / c. "
        "With the 1 the larger curvature does bound.",
    ),
]
