"""What Appendix B prints and what is traced, and what §5.1's short cut is worth."""

from __future__ import annotations

import functools

import numpy as np

from derivations.imaging import _surfaces as our
from firstorder.checks.tolerance import fitted_order, normwise

READINGS = ("gaussian", "root", "mean", "normal")

# --- counterexamples -----------------------------------------------------------------------------


def printed_turn(radius, angle):
    """(60) with rows on a cylinder: L = w_x in the world, frame along the axes, kappa = -1/R."""
    t, n = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    P = np.stack([n, np.zeros(3), -t])  # rows
    return float((-1.0 / radius * P @ np.array([np.sin(angle), 0.0, np.cos(angle)]))[0])


def traced_turn(radius, angle):
    """The same from the normals of the cylinder, by differences."""

    def seen(s):
        n = np.array([np.sin(s / radius), 0.0, np.cos(s / radius)])
        t = np.array([n[2], 0.0, -n[0]])
        return np.sin(angle) * t[0] + np.cos(angle) * n[0]

    return float(our.slope(seen))


def _sky(w):
    return np.exp(0.6 * w[0] - 0.4 * w[1] + 0.3 * w[2])


def _local(w_1, w_2):
    return np.array([w_1, w_2, np.sqrt(1.0 - w_1**2 - w_2**2)])


def length_from_l_and_m(w_1, w_2):
    """(L_l^2 + L_m^2)^(1/2) with the l and m of (62), on z = 0's frame."""
    w = _local(w_1, w_2)
    both = our.unit([-w[2], 0.0, w[0]]), our.unit([0.0, -w[2], w[1]])
    slopes = [our.slope(lambda s, e=e: _sky(w * np.cos(s) + e * np.sin(s))) for e in both]
    return float(np.hypot(*slopes))


def steepest(w_1, w_2):
    """The largest slope over all tangent directions, by search."""
    w = _local(w_1, w_2)
    e1 = our.unit(np.cross(w, [0.3, 0.1, 0.9]))
    e2 = np.cross(w, e1)
    turns = np.linspace(0.0, np.pi, 721)
    at = [
        our.slope(
            lambda s, a=a: _sky(w * np.cos(s) + (np.cos(a) * e1 + np.sin(a) * e2) * np.sin(s))
        )
        for a in turns
    ]
    return float(np.max(np.abs(at)))


def printed_mirror(w_1, w_2):
    """-L_u with the vector u itself at the mirrored direction, u in the plane of incidence."""
    w = _local(w_1, w_2)
    u, mirrored = our.unit([-w[2], 0.0, w[0]]), np.array([-w[0], -w[1], w[2]])
    return -float(our.slope(lambda s: _sky(our.unit(mirrored + s * u))))


def traced_mirror(w_1, w_2):
    """d/da of L at the mirror image of w + a u."""
    w = _local(w_1, w_2)
    u = our.unit([-w[2], 0.0, w[0]])
    M = np.diag([-1.0, -1.0, 1.0])
    return float(our.slope(lambda s: _sky(M @ (w * np.cos(s) + u * np.sin(s)))))


# --- R07 §5.1: what the short cut is worth ------------------------------------------------------


def _distant(x, w):
    """A sky alone: no spatial variation, so that only the curvature's term is judged."""
    return np.exp(0.6 * w[..., 0] - 0.4 * w[..., 1] * w[..., 2] + 0.3 * w[..., 2]) + 0.0 * x[0]


def _jax_distant(x, w):
    import jax.numpy as jnp

    return jnp.exp(0.6 * w[0] - 0.4 * w[1] * w[2] + 0.3 * w[2]) + 0.0 * x[0]


@functools.cache
def _short_cuts():
    """The short cut in all readings, and last the derived gradient, for a mirror."""
    import jax
    import jax.numpy as jnp

    from firstorder.imaging._reflection import direct_extension, reflected_radiance, surface_point

    def both(x, axes, S, v):
        point = surface_point(x, axes, S)
        B = reflected_radiance(_jax_distant, point, v)
        return jnp.stack([*(direct_extension(B, point, v, S, r) for r in READINGS), B.spatial])

    return jax.jit(jax.vmap(both))


def short_cuts(radii, tilt=0.0, turn=None, seed=3, count=16):
    """RMS error of each reading on an ellipsoid under distant light, relative to the RMS truth.

    The truth is traced: a mirror under the sky, differences along the surface.

    Args:
        radii: of the ellipsoid.
        tilt: angle of the eye from the normal.
        turn: of the tangents; None takes principal ones.
        seed: of the random places.
        count: how many.
    """
    import jax.numpy as jnp

    random, radii = np.random.default_rng(seed), np.asarray(radii, float)
    scenes, truths = [], []
    for _ in range(count):
        x = our.on_ellipsoid(our.unit(random.normal(size=3)), radii)
        axes = our.principal_frame(x, radii)[0] if turn is None else our.frame_at(x, turn, radii)
        a = random.uniform(0.0, 2.0 * np.pi)
        v = axes @ [np.sin(tilt) * np.cos(a), np.sin(tilt) * np.sin(a), np.cos(tilt)]

        def seen(s, i, x=x, axes=axes, v=v):
            y, n = our.moved(i, s, axes, x, radii)
            return _distant(y, 2.0 * (n @ v) * n - v)

        step = 0.01 * float(np.min(radii))
        truths.append([our.slope(lambda s, i=i: seen(s, i), step) for i in (0, 1)])
        scenes.append((x, axes, our.shape_operator(x, axes[:, :2], radii), v))
    arrays = [jnp.asarray(np.stack(a)) for a in zip(*scenes, strict=True)]
    found, true = np.asarray(_short_cuts()(*arrays)), np.array(truths)
    misses = np.sqrt(np.mean((found - true[:, None]) ** 2, axis=(0, 2)))
    return dict(zip((*READINGS, "derived"), misses / np.sqrt(np.mean(true**2)), strict=True))


def gaussian_on_a_ball(radius):
    """The short cut with K on a ball seen along its normal: 2 K L_u, L = w_x."""
    return 2.0 / radius**2 * -1.0


def traced_on_a_ball(radius):
    """The mirror image of L = w_x on a ball of that radius, by differences along x."""

    def seen(s):
        n = np.array([np.sin(s / radius), 0.0, np.cos(s / radius)])
        return (2.0 * n[2] * n - np.array([0.0, 0.0, 1.0]))[0]

    return float(our.slope(seen))


def gaussian_extension_error() -> float:
    """The library's reading of (25) with K on balls, against `2 K L_u` by hand."""
    import jax.numpy as jnp

    from firstorder.imaging._reflection import direct_extension, reflected_radiance, surface_point

    up, worst = jnp.array([0.0, 0.0, 1.0]), 0.0
    for radius in (1.0, 2.0):
        S = -jnp.eye(2) / radius
        ball = surface_point(jnp.zeros(3), jnp.eye(3), S)
        B = reflected_radiance(lambda x, w: w[0], ball, up)
        ours = direct_extension(B, ball, up, S, "gaussian")
        worst = max(worst, normwise(ours, np.array([gaussian_on_a_ball(radius), 0.0])))
    return worst


def gaussian_under_rescaling() -> float:
    """The size of the short cut with K, relative to the truth, is proportional to 1/scale."""
    scales = np.array([1.0, 2.0, 4.0])
    sizes = [abs(gaussian_on_a_ball(s) / traced_on_a_ball(s)) for s in scales]
    return abs(fitted_order(scales, sizes) + 1.0)


def tilt_order() -> float:
    """Principal curvatures: the error is of second order in the angle of the eye."""
    tilts = np.array([0.2, 0.1, 0.05])
    errors = [short_cuts(our.RADII, t)["normal"] for t in tilts]
    return abs(fitted_order(tilts, errors) - 2.0)


def roundness_order() -> float:
    """The mean curvature: the error is of first order in how far from round the surface is."""
    sizes = np.array([0.08, 0.04, 0.02])
    errors = [short_cuts(1.0 + s * np.array([1.0, -0.5, 0.2]))["mean"] for s in sizes]
    return abs(fitted_order(sizes, errors) - 1.0)
