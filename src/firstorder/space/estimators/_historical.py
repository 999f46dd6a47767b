"""Earlier gradients of irradiance over strata, and the naive Hessian, for comparison.

All are tangential. They use the same walls between cells as `stratified_estimate`, carried by the
nearer of both samples, and differ in what they multiply them with:

==================== =============================== ================================ =============
form                 circle of latitude              meridian                         cells
==================== =============================== ================================ =============
`stratified`         sin cos^2 int e_rho dphi        sin theta+ - sin theta-          any
`ward_heckbert`      sin cos^2 dphi e_rho(middle)    the same                         cosine
`jarosz`             sin cos^2 dphi e_rho(middle)    (sin^2 theta+ - sin^2 theta-)    any
                                                     / (2 sin theta_j)
`krivanek`           sin cos (cosine of the sample)  (cos theta- - cos theta+)        solid angle
                                                     / sin theta_j (same)
==================== =============================== ================================ =============

The chord of a column is `int e_rho dphi = 2 sin(dphi / 2) e_rho(middle)`.
"""

from __future__ import annotations

import jax.numpy as jnp
from jaxtyping import Array, Float

from firstorder.space.estimators._irradiance_forms import Samples, wall_jumps


def _middle(samples: Samples):
    """e_rho of each column's middle, e_phi of its first meridian, and its width."""
    phi = samples.strata.phi
    middle, first = 0.5 * (phi[1:] + phi[:-1]), phi[:-1]
    radial = jnp.stack([jnp.cos(middle), jnp.sin(middle)], -1)
    return radial, jnp.stack([-jnp.sin(first), jnp.cos(first)], -1), jnp.diff(phi)


def _summed(circles, radial, meridians, beside) -> Float[Array, "*k 2"]:
    step = jnp.einsum("...mn,ni->...i", circles, radial)
    return step + jnp.einsum("...mn,ni->...i", meridians, beside)


def ward_heckbert(samples: Samples) -> Float[Array, "*k 2"]:
    """The gradient of Ward and Heckbert, for rows of equal cosine-weighted solid angle.

    `sum_k { u_k (2 pi / N) sum_j sin cos^2(theta_j-) (L_j - L_j-1) / min(r, r') + v_k sum_j
    (sin theta_j+ - sin theta_j-) (L_k - L_k-1) / min(r, r') }`, `u_k = e_rho(phi_k)`,
    `v_k = e_phi(phi_k-)`.

    The walls are weighed with the cosine integrated along them: it differs from the analytic form
    only by the chord of a column, `(dphi / 2) / sin(dphi / 2) = 1 + dphi^2 / 24`. That earlier
    forms sampled the cosine at a point (J12 §7.1) is not true of this one.

    Args:
        samples: of `gather_samples`, with strata of the measure "cosine".

    Reference: Ward and Heckbert 1992; J12 §7.1.
    """
    theta = samples.strata.theta
    (circles, meridians), (near_c, near_m) = wall_jumps(samples)
    radial, beside, width = _middle(samples)
    s, c = jnp.sin(theta[1:-1]), jnp.cos(theta[1:-1])
    rising = jnp.diff(jnp.sin(theta))[:, None]
    weight = (s * c**2)[:, None] * width
    return _summed(circles * near_c * weight, radial, meridians * near_m * rising, beside)


def jarosz(samples: Samples) -> Float[Array, "*k 2"]:
    """J12's stratified gradient as printed in (64), its signs, indices and half put right.

    The meridian moves by `grad phi = -e_phi / (r sin theta_j)` and sweeps `(sin^2 theta+ -
    sin^2 theta-) / 2` by its angle: with `sin theta_j` the mean of the two border's sines that is
    `sin theta+ - sin theta-`, exactly. Here theta_j is the middle of the row.

    Args:
        samples: of `gather_samples`, in any strata.

    Reference: J12 §7.1, eq. 64.
    """
    theta = samples.strata.theta
    (circles, meridians), (near_c, near_m) = wall_jumps(samples)
    radial, beside, width = _middle(samples)
    s, c = jnp.sin(theta[1:-1]), jnp.cos(theta[1:-1])
    middle = jnp.sin(0.5 * (theta[1:] + theta[:-1]))
    rising = (0.5 * jnp.diff(jnp.sin(theta) ** 2) / middle)[:, None]
    weight = (s * c**2)[:, None] * width
    return _summed(circles * near_c * weight, radial, meridians * near_m * rising, beside)


def krivanek(samples: Samples, moving_cosine: bool = True) -> Float[Array, "*k 2"]:
    """The gradient of Krivanek et al. for any weight, here the cosine, sampled at each direction.

    The estimate `sum A L cos` is differentiated: the areas A of the cells by the motion of their
    walls, and the cosines by that of the samples, `grad cos = sin cos / r e_rho`. Reconstructed
    after J12 §7.1 and the published description; cells are of equal solid angle.

    Args:
        samples: of `gather_samples`, with strata of the measure "solid angle".
        moving_cosine: False leaves out the second term, which does not tend to the truth.

    Reference: Krivanek, Gautron, Bouatouch and Pattanaik 2005; J12 §7.1.
    """
    where, w = samples.strata, 1.0 / samples.distance
    cosine = jnp.broadcast_to(where.directions[..., 2], samples.radiance.shape)
    F = samples.radiance * cosine
    _, (near_c, near_m) = wall_jumps(samples)
    radial, beside, width = _middle(samples)
    s, c = jnp.sin(where.theta[1:-1]), jnp.cos(where.theta[1:-1])
    middle = jnp.sin(0.5 * (where.theta[1:] + where.theta[:-1]))
    falling = (-jnp.diff(jnp.cos(where.theta)) / middle)[:, None]
    circles = jnp.diff(F, axis=-2) * near_c * (s * c)[:, None] * width
    found = _summed(circles, radial, (F - jnp.roll(F, 1, -1)) * near_m * falling, beside)
    if not moving_cosine:
        return found
    area = -jnp.diff(jnp.cos(where.theta))[:, None] * width
    away = jnp.broadcast_to(where.directions[..., :2], (*F.shape, 2))  # sine times e_rho
    moved = area * samples.radiance * w * cosine
    return found + jnp.einsum("...mn,...mni->...i", moved, away)


def naive_hessian(samples: Samples, corners: bool = True) -> Float[Array, "*k 2 2"]:
    """The Hessian of the strata's walls as if each stayed a circle or a meridian: **not usable**.

    `(L_in - L_out) dphi / 2 H(sin^2 theta) + (L_before - L_after) dsin^2 / 2 H(phi)`, each wall
    taken for a point at `min(r, r')`, and at the corners the products `grad phi grad sin^2`:

    `H(sin^2) = 2 cos^2 ((1 - 4 sin^2) e_rho e_rho^T + e_phi e_phi^T) / r^2`,
    `H(phi) = -(e_rho e_phi^T + e_phi e_rho^T) / (r sin)^2`.

    It does not tend to the truth: an edge that crosses cells becomes a staircase, whose treads and
    risers move as if parts of circles and meridians, and background behind edges counts as
    constant. J12 §7.2 calls it not feasible; its error stays of the size of the Hessian itself
    (`tests/space/estimators/test_historical.py`). Use it to measure that.

    Args:
        samples: of `gather_samples`, in any strata.
        corners: whether to count the products.

    Reference: J12 §7.2.
    """
    theta = samples.strata.theta
    (circles, meridians), (near_c, near_m) = wall_jumps(samples)
    radial, beside, width = _middle(samples)
    across = jnp.stack([-radial[:, 1], radial[:, 0]], -1)
    s, c = jnp.sin(theta[1:-1]), jnp.cos(theta[1:-1])
    rr, pp = (v[:, :, None] * v[:, None, :] for v in (radial, across))
    J = -circles * near_c**2 * (c * c)[:, None] * width
    H = jnp.einsum("...mn,m,nij->...ij", J, 1.0 - 4.0 * s * s, rr)
    H = H + jnp.einsum("...mn,nij->...ij", J, pp)
    first = jnp.stack([beside[:, 1], -beside[:, 0]], -1)  # e_rho at the meridian
    twist = _twice(first, beside)
    sine = jnp.sin(0.5 * (theta[1:] + theta[:-1]))
    ring = 0.5 * jnp.diff(jnp.sin(theta) ** 2) / sine**2
    H = H + jnp.einsum("...mn,m,nij->...ij", meridians * near_m**2, ring, twist)
    if not corners:
        return H
    # phi sin^2 / 2 at corners: grad phi = -e_phi / (r s), grad sin^2 = -2 s c^2 e_rho / r.
    jump = meridians[..., 1:, :] - meridians[..., :-1, :]
    near = jnp.maximum(near_m[..., 1:, :], near_m[..., :-1, :])
    return H + jnp.einsum("...mn,m,nij->...ij", jump * near**2, c * c, twist)


def _twice(a, b):
    return a[:, :, None] * b[:, None, :] + b[:, :, None] * a[:, None, :]
