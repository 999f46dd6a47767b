"""What an image's bandwidth is, pixel by pixel, in space and with blockers (D05 §6.2).

Proofs start from vectors: a quadric, an eye, the law of reflection and a blocker's point. Numbers
come from rays (`_bandwidth_space`), and for densities from images that are interpolated.
"""

from __future__ import annotations

import numpy as np
import sympy as sp

from derivations.bandwidth import _bandwidth_space as space
from firstorder.ledger import Check, Row, na

d, depth, alpha = sp.symbols("d depth alpha", positive=True)
x, y = sp.symbols("x y", real=True)
S11, S12, S22 = sp.symbols("S_11 S_12 S_22", real=True)

# --- proofs ------------------------------------------------------------------------------------


def _quadric():
    """Point, normal and unit vector to the eye near the origin."""
    P = sp.Matrix([x, y, (S11 * x**2 + 2 * S12 * x * y + S22 * y**2) / 2])
    N = sp.Matrix([-P[2].diff(x), -P[2].diff(y), 1])
    to_eye = d * sp.Matrix([sp.sin(alpha), 0, sp.cos(alpha)]) - P
    return P, N / sp.sqrt(N.dot(N)), to_eye / sp.sqrt(to_eye.dot(to_eye))


def _turn(w, one, two):
    """How w turns with (x, y) at the origin, along two vectors across it."""
    J = w.jacobian([x, y]).subs({x: 0, y: 0})
    return sp.Matrix([(one.T * J)[:], (two.T * J)[:]])


def _eye_axes():
    return sp.Matrix([sp.cos(alpha), 0, -sp.sin(alpha)]), sp.Matrix([0, 1, 0])


def blocker_in_the_mirror():
    """A blocker's point in the mirrored direction turns by -d / d' per turn of the eye.

    In the axes in which a flat mirror turns what is seen by +1 (`mirror_in_space`).
    """
    P, _, to_eye = _quadric()
    at = depth * sp.Matrix([-sp.sin(alpha), 0, sp.cos(alpha)]) - P
    across = sp.Matrix([-sp.cos(alpha), 0, -sp.sin(alpha)]), sp.Matrix([0, -1, 0])
    J = _turn(at / sp.sqrt(at.dot(at)), *across) * _turn(to_eye, *_eye_axes()).inv()
    return list((J + d / depth * sp.eye(2)).applyfunc(sp.simplify))


def _footprint():
    """F: how the point that is seen moves per turn of the eye, over d; psi turns the eye's ray."""
    *_, to_eye = _quadric()
    return -_turn(to_eye, *_eye_axes()).inv()


def normal_of_the_eye():
    """The footprint is d diag(1/c, 1), and the normal turns by -S times it."""
    _, N, _ = _quadric()
    ex, ey = sp.Matrix([1, 0, 0]), sp.Matrix([0, 1, 0])
    F = sp.diag(1 / sp.cos(alpha), 1)
    S = sp.Matrix([[S11, S12], [S12, S22]])
    moved = _footprint() - d * F
    turned = _turn(N, ex, ey) * _footprint() + d * S * F
    return [sp.simplify(e) for e in (*moved, *turned)]


def blocker_anywhere():
    """A blocker's point at d' w turns by -(1 - w w^T) x / d', which is no longer than x / d'."""
    v, move = (sp.Matrix(sp.symbols(f"{name}1:4", positive=True)) for name in "vx")
    square = v.dot(v)
    at = depth * v - move  # at the distance |v| depth in the direction v / |v|
    J = (at / sp.sqrt(at.dot(at))).jacobian(list(move)).subs(dict.fromkeys(move, 0))
    across = square * sp.eye(3) - v * v.T  # |v|^2 (1 - w w^T)
    turned = J * depth * sp.sqrt(square) * square + across
    shorter = (across * move).dot(across * move) - square * (
        square * move.dot(move) - v.dot(move) ** 2
    )
    return [*turned.applyfunc(sp.simplify), sp.expand(shorter)]


def slopes_weigh_changes():
    """Edges across a ray's cell: light that moves is g |dx| / d' times their density.

    Rays i carry light g_i; over their cell of width a, blockers at d_i' have n a edges, each of
    which moves by dx / d_i' and so changes the cell's light by g_i / a times that. Summed over rays
    it is n dx sum g_i / d_i', the total light times n dx times the weighted mean of 1 / d_i'.
    """
    g, D = sp.symbols("g1:4", positive=True), sp.symbols("d1:4", positive=True)
    n, a, dx = sp.symbols("n a dx", positive=True)
    changed = sum((n * a) * (gi / a) * (dx / di) for gi, di in zip(g, D, strict=True))
    mean = sum(gi / di for gi, di in zip(g, D, strict=True)) / sum(g)
    harmonic = sum(g) / sum(gi / di for gi, di in zip(g, D, strict=True))
    return [sp.simplify(changed - sum(g) * n * dx * mean), sp.simplify(mean - 1 / harmonic)]


def densities():
    """With errors B^2 / rho, the sum of squares is stationary at rho ~ B^(4/3), and convex."""
    B1, B2, N, r = sp.symbols("B_1 B_2 N r", positive=True)
    total = B1**4 / r**2 + B2**4 / (N - r) ** 2
    power = sp.Rational(4, 3)
    best = N * B1**power / (B1**power + B2**power)
    curved = sp.diff(total, r, 2) - 6 * (B1**4 / r**4 + B2**4 / (N - r) ** 4)
    slope = sp.diff(total, r).subs(r, best)
    return [sp.simplify(sp.powsimp(sp.simplify(slope), force=True)), sp.simplify(curved)]


# --- numbers -----------------------------------------------------------------------------------


def _seen(distance, S, theta):
    import jax.numpy as jnp

    from firstorder.imaging.hits import GBuffer

    up, one = jnp.array([0.0, 0.0, 1.0]), jnp.ones(())
    return GBuffer(0.0 * up, up, up, distance * one, np.cos(theta) * one, jnp.asarray(S))


def by_rays(gloss: bool) -> float:
    """Maps against the spectral norms of turns of traced rays."""
    from firstorder.bandwidth.pixel_rates import diffuse_bandwidth_map, glossy_bandwidth_map

    worst = 0.0
    for D, S, theta, s in space.configurations(20, seed=3):
        lobe, blocker = space.turns(D, S, theta, s, gloss)
        at, cutoff, light = _seen(D, S, theta), 1.3, 0.7
        apart, moved = (np.linalg.norm(M, 2) for M in (lobe - blocker, blocker))
        if gloss:
            ours, true = glossy_bandwidth_map(cutoff, at, s, light), apart * cutoff + moved * light
        else:
            ours = diffuse_bandwidth_map(cutoff, at, s, light)
            true = np.linalg.norm(lobe, 2) * cutoff + moved * (cutoff + light)
        worst = max(worst, float(abs(float(ours) - true) / true))
    return worst


def by_slices(gloss: bool) -> float:
    """Maps against the ends of measured spectra of slices; diffuse on bumps, where it is reached.

    A window of 2 mrad has peaks 80 cycles per radian wide, at 1,500 and more.
    """
    from firstorder.bandwidth.pixel_rates import diffuse_bandwidth_map, glossy_bandwidth_map

    worst, own = 0.0, glossy_bandwidth_map if gloss else diffuse_bandwidth_map
    for k, (D, S, theta, s) in enumerate(space.configurations(3, seed=8, bump=not gloss)):
        s = 0.0 if gloss and k == 0 else s
        cutoff, light = 1500.0, 900.0
        found = space.reach(D, S, theta, s, gloss, cutoff, light, tries=2)
        ours = float(own(cutoff, _seen(D, S, theta), s, light if s else 0.0))
        worst = max(worst, abs(found - ours) / ours)
    return worst


def changes() -> float:
    """Light that rays lose and gain behind random blockers, against `mean_inverse_distance`.

    Directions in 40 sectors; in each, edges anywhere in equal strata and a depth of its own; the
    receiver moves across all of them by 2 micrometres: few edges pass a ray twice.
    """
    from firstorder.bandwidth.pixel_rates import mean_inverse_distance

    rng = np.random.default_rng(2)
    sectors, edges, rays, step = 40, 60, 100000, 2e-6
    depths, weight = 10.0 ** rng.uniform(-0.5, 1.0, sectors), rng.uniform(0.2, 3.0, sectors)
    taken, wide = 0.0, 1e-2  # each sector's angle: small, so that slopes are angles
    for D, g in zip(depths, weight, strict=True):
        at = (np.arange(-6, edges + 6) + rng.uniform(size=edges + 12)) / edges
        ray = (np.arange(rays) + 0.5) / rays
        before, after = (np.searchsorted(at, ray + m) % 2 for m in (0.0, step / D / wide))
        taken += g * np.mean(before != after)
    rate = taken / np.sum(weight) / step
    density = edges / wide
    ours = float(mean_inverse_distance(np.asarray(depths), np.asarray(weight))) * density
    return abs(rate - ours) / ours


def best_split() -> float:
    """The best split of samples between two waves, bilinear on grids: `sampling_density`."""
    from firstorder.bandwidth.pixel_rates import sampling_density

    B = np.array([0.02, 0.05])  # cycles per pixel, in equal areas
    splits = np.linspace(0.1, 0.6, 201)
    steps = np.sqrt(1.0 / np.stack([splits, 1.0 - splits]))  # of grids with these shares
    errors = sum(_wave_error(b, h) for b, h in zip(B, steps, strict=True))
    ours = sampling_density(B, power=4.0 / 3.0, even=0.0)
    share = ours[0] / np.sum(ours)
    return abs(splits[np.argmin(errors)] - share) / share


def _wave_error(frequency: float, steps) -> np.ndarray:
    """Mean square error of linear interpolation of a wave, over all phases, on grids of steps."""
    t = np.linspace(0.0, 1.0, 65)[1:-1]
    phase = np.linspace(0.0, 2.0 * np.pi, 33)[:-1, None]

    def wave(at):
        return np.cos(2.0 * np.pi * frequency * at + phase)

    missed = [wave(t * h) - (1.0 - t) * wave(0.0) - t * wave(h) for h in steps]
    return np.array([np.mean(e**2) for e in missed])


# --- rows --------------------------------------------------------------------------------------

ROWS = [
    Row(
        "C.bandwidth.glossy",
        "identity",
        implements="firstorder.bandwidth.pixel_rates.glossy_bandwidth_map",
        symbolic=blocker_in_the_mirror,
        autodiff=na("two routes"),
        fourier=Check(lambda: by_slices(gloss=True), 1e-2),
        brute_force=Check(lambda: by_rays(gloss=True), 1e-6),
        note="J is D05.s6.2i's. In the mirrored direction a blocker's term has no 1 / (n . v).",
    ),
    Row(
        "C.bandwidth.diffuse",
        "identity",
        implements="firstorder.bandwidth.pixel_rates.diffuse_bandwidth_map",
        symbolic=lambda: [*normal_of_the_eye(), *blocker_anywhere()],
        autodiff=na("two routes"),
        fourier=Check(lambda: by_slices(gloss=False), 1e-2),
        brute_force=Check(lambda: by_rays(gloss=False), 1e-6),
        note="A bound for blockers anywhere, reached on bumps by those along the normal.",
    ),
    Row(
        "C.bandwidth.slope",
        "identity",
        implements="firstorder.bandwidth.pixel_rates.mean_inverse_distance",
        symbolic=slopes_weigh_changes,
        autodiff=na("no derivative"),
        fourier=na("one route"),
        brute_force=Check(changes, 0.02),
        note="Why harmonic: slopes add. Light that changes, not a bound of frequency (D05.s6.2h). "
        "Counted at 2,400 edges.",
    ),
    Row(
        "C.bandwidth.density",
        "identity",
        implements="firstorder.bandwidth.pixel_rates.sampling_density",
        symbolic=densities,
        autodiff=na("no derivative"),
        fourier=na("one route"),
        brute_force=Check(best_split, 0.02),
        note="Where all waves have one height and the interpolation converges; Nyquist's rate is "
        "B^2.",
    ),
]
