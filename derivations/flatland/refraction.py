"""Light through a glass disc: its deflection, its rainbow, its caustic, where the power goes."""

from __future__ import annotations

import functools

import numpy as np
import sympy as sp

from firstorder.ledger import Check, Row, na

i, t, k, n, R, h = sp.symbols("i t k n R h", positive=True)
INDEX = 1.5


# --- proofs --------------------------------------------------------------------------------------


def least_deflection():
    """A ray turns by i - t on the way in and out and by pi - 2 t at each reflection inside."""
    inner = sp.asin(sp.sin(i) / n)
    turned = 2 * (i - inner) + k * (sp.pi - 2 * inner)
    slope = sp.diff(turned, i)
    at = sp.acos(sp.sqrt((n**2 - 1) / (k * (k + 2))))
    # slope = 2 - 2 (k + 1) cos i / sqrt(n^2 - sin^2 i): squared, to be rid of roots
    ratio = (k + 1) ** 2 * sp.cos(i) ** 2 / (n**2 - sp.sin(i) ** 2)
    same = slope - (2 - 2 * (k + 1) * sp.cos(i) / sp.sqrt(n**2 - sp.sin(i) ** 2))
    return sp.simplify(same), sp.simplify(ratio.subs(i, at) - 1)


def caustic_of_one_surface():
    """Parallel rays through a circle: the envelope lies at `n R cos^2 t / (n cos t - cos i)`.

    The surface is R (sin i, -cos i), rays come along +y; behind it their angle from +y is i - t.
    """
    inner = sp.asin(sp.sin(i) / n)
    p = sp.Matrix([R * sp.sin(i), -R * sp.cos(i)])
    u = sp.Matrix([-sp.sin(i - inner), sp.cos(i - inner)])
    cross = lambda a, b: a[0] * b[1] - a[1] * b[0]  # noqa: E731
    distance = -cross(p.diff(i), u) / cross(u.diff(i), u)
    claim = n * R * sp.cos(inner) ** 2 / (n * sp.cos(inner) - sp.cos(i))
    return sp.simplify(sp.expand_trig(sp.simplify(distance - claim)))


def power():
    """Reflected at once, or let in, reflected k times and let out: it adds up to all."""
    r = sp.Symbol("r", positive=True)
    inside = sp.Symbol("m", integer=True, nonnegative=True)
    first = 1 - (r + (1 - r) ** 2 * (1 / (1 - r)))
    partial = sp.summation(r**inside, (inside, 0, 5)) - (1 - r**6) / (1 - r)
    return sp.simplify(first), sp.simplify(partial)


# --- brute force: vectors in NumPy ---------------------------------------------------------------


def _step(p, u, radius, eta, reflect):
    """From a point inside, or before, a disc about 0 to its far, or near, side; there it bends."""
    b = np.sum(p * u, 1)
    root = np.sqrt(np.maximum(b**2 - np.sum(p * p, 1) + radius**2, 0.0))
    far = np.sum(p * p, 1) <= radius**2 * (1.0 + 1e-9)
    p = p + np.where(far, root - b, -b - root)[:, None] * u
    normal = p / radius
    c = -np.sum(normal * u, 1)
    normal, c = normal * np.sign(c)[:, None], np.abs(c)
    g = np.sqrt(np.maximum(eta**2 - 1.0 + c**2, 0.0))
    s, q = (c - g) / (c + g), (eta**2 * c - g) / (eta**2 * c + g)
    share = 0.5 * (s**2 + q**2)
    if reflect:
        return p, u + 2.0 * c[:, None] * normal, share
    return p, (u + (c - g)[:, None] * normal) / eta, 1.0 - share


def photons(p, u, radius=1.0, index=INDEX, inside=0):
    """Places, directions and shares of power after a disc about the origin."""
    p, u, share = _step(p, u, radius, index, False)
    for _ in range(inside):
        p, u, more = _step(p, u, radius, 1.0 / index, True)
        share = share * more
    p, u, more = _step(p, u, radius, 1.0 / index, False)
    return p, u, share * more


def parallel(offsets):
    """Rays along +y towards the disc."""
    p = np.stack([offsets, np.full_like(offsets, -3.0)], -1)
    return p, np.broadcast_to([0.0, 1.0], p.shape)


def sampled_rainbow(inside: int, index: float = 4.0 / 3.0) -> float:
    """Offset of the ray of least deflection, from a parabola through the best of many."""
    b = np.linspace(0.5, 0.99, 20_001)
    _, u, _ = photons(*parallel(b), index=index, inside=inside)
    angle = np.unwrap(np.arctan2(-u[:, 0], u[:, 1]))
    turns = np.flatnonzero(np.diff(np.sign(np.diff(angle))))[0] + 1
    y = angle[turns - 1 : turns + 2]
    return float(b[turns] + 0.5 * (b[1] - b[0]) * (y[0] - y[2]) / (y[0] - 2.0 * y[1] + y[2]))


def rainbow_error() -> float:
    from firstorder.flatland.refraction import rainbow_incidence

    return max(abs(sampled_rainbow(m) - np.sin(rainbow_incidence(4.0 / 3.0, m))) for m in (1, 2))


@functools.cache
def glass(inside: int = 0, index: float = INDEX):
    from firstorder.flatland import Circles, Scene, Segments, primitive
    from firstorder.flatland.refraction import Beam, Caustic, through_body

    ball = primitive(Circles((0.0, 0.0), 1.0), ior=index)
    screen = primitive(Segments((2.0, 1.25), (-2.0, 1.25)), name="screen")
    path = through_body(1, inside=inside)
    return Caustic(Scene.of(screen, ball), Beam((0.0, -3.0), 0.0), path, 0, -0.999, 0.999)


def turning_error() -> float:
    """Slope of the outgoing angle at the rainbow's ray, by automatic differentiation."""
    import jax

    from firstorder.flatland.refraction import rainbow_incidence, trace_path

    lens = glass(1, 4.0 / 3.0)

    def angle(q):
        u = trace_path(lens.scene, lens.path, *lens.light.ray(q)).along
        return u[0] / u[1]

    slope, scale = (
        float(jax.jit(jax.grad(angle))(b)) for b in (np.sin(rainbow_incidence(4.0 / 3.0, 1)), 0.3)
    )
    return abs(slope / scale)


def caustic_errors() -> tuple[float, float]:
    """Of the envelope behind the first surface: the library's, and that of neighbouring rays."""
    import jax

    from firstorder.flatland.refraction import THROUGH, Beam, Caustic

    lens = Caustic(glass().scene, Beam((0.0, -3.0), 0.0), ((1, THROUGH),), 0, -0.9, 0.9)
    b = np.array([0.1, 0.4, 0.7])
    cos_i, cos_t = np.sqrt(1.0 - b**2), np.sqrt(1.0 - (b / INDEX) ** 2)
    truth = INDEX * cos_t**2 / (INDEX * cos_t - cos_i)
    ours = jax.jit(jax.vmap(lambda q: lens.envelope(q)[1]))(b)
    step = 1e-5
    (p, u, _), (q, v, _) = (_step(*parallel(b + d), 1.0, INDEX, False) for d in (-step, step))
    way = q - p
    met = (way[:, 0] * v[:, 1] - way[:, 1] * v[:, 0]) / (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
    return float(np.abs(ours / truth - 1.0).max()), float(np.abs(met / truth - 1.0).max())


def power_error() -> float:
    """What leaves after up to seven reflections inside, and at once, less all; random rays.

    And the library's share at once against that of the rays.
    """
    from firstorder.flatland.refraction import fresnel_reflectance

    b = np.random.default_rng(0).uniform(-0.95, 0.95, 1000)
    shares = [photons(*parallel(b), inside=m)[2] for m in range(8)]
    _, _, first = _step(*parallel(b), 1.0, INDEX, True)
    left = (1.0 - first) * first**8
    ours = np.asarray(fresnel_reflectance(INDEX, np.sqrt(1.0 - b**2)))
    whole = np.abs(first + sum(shares) + left - 1.0).max()
    return float(max(whole, np.abs(ours - first).max()))


ROWS = [
    Row(
        "C.refraction.rainbow",
        "identity",
        "firstorder.flatland.refraction.rainbow_incidence",
        symbolic=least_deflection,
        autodiff=Check(turning_error, 1e-9),
        fourier=na("no spectrum"),
        brute_force=Check(rainbow_error, 1e-7),
    ),
    Row(
        "C.refraction.caustic",
        "identity",
        "firstorder.flatland.refraction.Caustic.envelope",
        symbolic=caustic_of_one_surface,
        autodiff=Check(lambda: caustic_errors()[0], 1e-11),
        fourier=na("no spectrum"),
        brute_force=Check(lambda: caustic_errors()[1], 1e-4),
    ),
    Row(
        "C.refraction.energy",
        "identity",
        "firstorder.flatland.refraction.fresnel_reflectance",
        symbolic=power,
        autodiff=na("no derivative"),
        fourier=na("no spectrum"),
        brute_force=Check(power_error, 1e-12),
    ),
]
