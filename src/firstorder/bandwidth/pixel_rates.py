r"""Sampling rates of image pixels from exact hits: D05 §6.2 in space, with blockers.

An eye that turns by psi moves what it sees by x = d F psi over the surface: d the distance, F = 1
across the plane of view and 1 / c along it, c the cosine to the normal. There

    the mirrored direction turns by    J psi = (1 - 2 d (S_11 / c, S_12; S_12, c S_22)) psi
    the normal turns by                N psi = -d S F psi
    a blocker at d' seems to turn by   -s P x      s = 1 / d', P across the way to it

With W_L, W_V and W_rho points of energy of the light, of the blockers and of the lobe, all about
the same direction, an integral over directions keeps W_L + W_V + W_rho = 0. Blockers have all
frequencies, so what the eye sees reaches up to

    glossy    |J + d s| Omega_rho + d s Omega_L               (blockers where it looks)
    diffuse   |N| Omega_cos + (d s / c) (Omega_cos + Omega_L) (blockers anywhere)

cycles per radian: spectral norms, the worst direction in the image. `screen_space` has J, N and
x from differences between pixels instead, as the paper does.

Of many blockers `mean_inverse_distance` takes the mean of 1 / d', the harmonic mean of the
distances: slopes add and distances do not, and a ray that meets nothing has the slope 0 and no
    distance.
"""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from firstorder._argument_checks import (
    check_between,
    check_broadcast,
    check_finite,
    check_not_negative,
    check_positive,
    nan_unless,
    not_negative,
)
from firstorder.bandwidth._spectral_norm import reach, spectral_norm
from firstorder.imaging.camera import Pinhole
from firstorder.imaging.hits import GBuffer
from firstorder.scene._arguments import numbers
from firstorder.space.intersect import nearest
from firstorder.space.scene import Scene
from firstorder.typing import RealLike, as_float

NYQUIST = 0.5  # cycles per pixel: nobody sees more

Numbers = Float[Array | np.ndarray, "*n"]


# --- criteria ------------------------------------------------------------------------------------


def glossy_bandwidth_map(
    cutoff: RealLike, at: GBuffer, slope: RealLike = 0.0, light: RealLike = 0.0
) -> Float[Array, "*n"]:
    """Angular bandwidth at the eye of light reflected about the mirrored direction.

    `|J + d s| cutoff + d s light`, J as the module has it.

    Valid to first order, pointwise, for blockers in the mirrored direction; a bound for light whose
    spectrum ends at `light`, and without blockers (`slope` 0) the exact reach. Numbers, or
    arrays with one for each pixel.

    Args:
        cutoff: where the lobe's spectrum ends, or that of the light if it ends before; infinity if
            neither does (`rms_cutoff`) [1/rad].
        at: pixels.
        slope: `1 / d'` of blockers, 0 for none [1/m].
        light: where the spectrum of the light ends that blockers cut [1/rad].

    Returns:
        Cycles per radian of the eye.

    Raises:
        ValueError: for an argument outside its range; traced ones give NaN.

    Reference: D05 §6.2, eqs. 20-21, in space (`C.bandwidth.glossy`).

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.bandwidth import glossy_bandwidth_map
        >>> from firstorder.imaging import GBuffer
        >>> up, one = jnp.array([0.0, 0.0, 1.0]), jnp.ones(())
        >>> ball = GBuffer(0.0 * up, up, up, 3.0 * one, one, -jnp.eye(2) / 2.0)
        >>> glossy_bandwidth_map(1.0, ball).item(), glossy_bandwidth_map(1.0, ball,
        ...     slope=0.5).item()
        (4.0, 5.5)
    """
    valid, d, s = _checked(cutoff, at, slope, light)
    c, S = as_float(at.cosine), as_float(at.S)
    first = jnp.stack([1.0 - 2.0 * d * S[..., 0, 0] / c + d * s, -2.0 * d * S[..., 0, 1]], -1)
    second = jnp.stack([-2.0 * d * S[..., 1, 0], 1.0 - 2.0 * d * c * S[..., 1, 1] + d * s], -1)
    J = jnp.stack([first, second], -2)
    return nan_unless(valid, reach(spectral_norm(J), cutoff) + d * s * as_float(light))


def diffuse_bandwidth_map(
    cutoff: RealLike, at: GBuffer, slope: RealLike = 0.0, light: RealLike = 0.0
) -> Float[Array, "*n"]:
    """Angular bandwidth at the eye of light reflected about the normal: irradiance.

    `|N| cutoff + (d s / c) (cutoff + light)`, N as the module has it. Numbers, or
    arrays with one for each pixel.

    Args:
        cutoff: where the spectrum of the cosine ends [1/rad].
        at: pixels.
        slope: as in `glossy_bandwidth_map`.
        light: as in `glossy_bandwidth_map`.

    Returns:
        Cycles per radian of the eye.

    Raises:
        ValueError: for an argument outside its range; traced ones give NaN.

    Reference: D05 §6.2 for a lobe that follows the normal (`C.bandwidth.diffuse`).

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.bandwidth import diffuse_bandwidth_map
        >>> from firstorder.imaging import GBuffer
        >>> up, one = jnp.array([0.0, 0.0, 1.0]), jnp.ones(())
        >>> ball = GBuffer(0.0 * up, up, up, 3.0 * one, one, -jnp.eye(2) / 2.0)
        >>> diffuse_bandwidth_map(1.0, ball).item(), diffuse_bandwidth_map(1.0, ball,
        ...     slope=0.5).item()
        (1.5, 3.0)
    """
    valid, d, s = _checked(cutoff, at, slope, light)
    c, S = as_float(at.cosine), as_float(at.S)
    N = d[..., None, None] * S * jnp.stack([1.0 / c, jnp.ones_like(c)], -1)[..., None, :]
    both = as_float(cutoff) + as_float(light)
    return nan_unless(valid, reach(spectral_norm(N), cutoff) + reach(d * s / c, both))


def _checked(cutoff, at: GBuffer, slope, light) -> tuple[Array, Array, Array]:
    """Whether the arguments are valid, and distances and slopes."""
    check_not_negative("distance", at.distance)
    check_positive("cosine", at.cosine)
    check_finite("S", at.S)
    d, c = as_float(at.distance), as_float(at.cosine)
    surface = (d >= 0.0) & (c > 0.0) & jnp.all(jnp.isfinite(as_float(at.S)), (-2, -1))
    return _bands(cutoff, slope, light) & surface, d, as_float(slope)


def _bands(cutoff, slope, light) -> Array:
    """Whether band limits and slopes are valid; where a lobe's spectrum ends may be infinite."""
    check_between("cutoff", cutoff, 0.0, np.inf)
    for name, value in (("slope", slope), ("light", light)):
        check_finite(name, value)
        check_not_negative(name, value)
    s, L = as_float(slope), as_float(light)
    ends = (s >= 0.0) & (L >= 0.0) & jnp.isfinite(s) & jnp.isfinite(L)
    return ends & (as_float(cutoff) >= 0.0)


def rms_cutoff(exponent: RealLike) -> Float[Array, "..."]:
    """Root mean square frequency of `cos^s`, cut off at zero: `s / (2 pi sqrt(2 s - 1))` [1/rad].

    The clamped cosine itself has s = 1; a narrow lobe is nearly a Gaussian of standard deviation
    `1 / sqrt(s)`. Infinite for s <= 1/2, where the end at the horizon is too steep.

    Args:
        exponent: s, a number or an array.

    Raises:
        ValueError: if it is negative or not finite; traced ones give NaN.

    Example:
        >>> from firstorder.bandwidth import rms_cutoff
        >>> [round(rms_cutoff(s).item(), 3) for s in (1.0, 200.0)]
        [0.159, 1.594]
    """
    s = not_negative(as_float(exponent))
    check_finite("exponent", s)
    check_not_negative("exponent", s)
    steep = 2.0 * s <= 1.0
    return jnp.where(
        steep, jnp.inf, s / (2.0 * jnp.pi * jnp.sqrt(jnp.where(steep, 1.0, 2.0 * s - 1.0)))
    )


# --- blockers ------------------------------------------------------------------------------------


def mean_inverse_distance(
    distance: ArrayLike,
    weight: ArrayLike | None = None,
) -> Float[Array, "*n"]:
    """Mean of `1 / d'` over rays: the inverse of the harmonic mean of blockers' distances [1/m].

    Where edges are equally dense in all directions, the light that they take and give while the
    receiver moves by a metre is proportional to it, each ray weighted by the light it carries
    (`C.bandwidth.slope`). It does not bound: the nearest blocker's slope is larger.

    Args:
        distance: to what each ray meets, shape (..., k), infinity where it meets nothing [m].
        weight: light that a ray would carry, unblocked, shape (..., k); the same for all, if left
            out.

    Returns:
        0 where nothing is met, or no ray carries light.

    Raises:
        ValueError: for a distance that is not positive or a weight that is negative; traced ones
            give NaN. If distances have no axis of rays, or weights do not fit them.

    Reference: D05 §6.2; the weights are what it asks for at its end.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.bandwidth import mean_inverse_distance
        >>> d = jnp.array([0.5, 2.0, jnp.inf])
        >>> round(mean_inverse_distance(d).item(), 4), mean_inverse_distance(d, jnp.array([0.0, 1.0,
        ...     3.0])).item()
        (0.8333, 0.125)
    """
    d = as_float(distance)
    met = d != jnp.inf
    check_positive("distance", jnp.where(met, d, 1.0))
    if not d.ndim:
        raise ValueError("Argument `distance` must have an axis of rays, but is one number.")
    w = jnp.ones_like(d) if weight is None else as_float(weight)
    check_broadcast("weight", w, d.shape)
    w = jnp.broadcast_to(w, d.shape)
    check_not_negative("weight", w)
    near = (d > 0.0) & met
    slope = jnp.where(near, 1.0 / jnp.where(near, d, 1.0), 0.0)
    total = jnp.sum(w, -1)
    valid = jnp.all((d > 0.0) & (w >= 0.0), -1)
    return nan_unless(valid, jnp.sum(w * slope, -1) / jnp.where(total > 0.0, total, 1.0))


def blocker_distance(
    scene: Scene, x: ArrayLike, along: ArrayLike, on: ArrayLike
) -> Float[Array, "n k"]:
    """Distance along rays from points to the next surface; infinite for a miss [m].

    Args:
        scene: shapes.
        x: points on surfaces, shape (n, 3) [m].
        along: unit vectors, k from each, shape (n, k, 3).
        on: number of the shape on which each point lies, shape (n,).

    Raises:
        ValueError: if a point or a direction is not finite.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.bandwidth import blocker_distance
        >>> from firstorder.space.library import sphere_over_plane
        >>> up = jnp.array([[[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]])
        >>> scene, none = sphere_over_plane(), jnp.array([-1])
        >>> blocker_distance(scene, jnp.array([[0.0, 0.0, 9.0]]), up, none).tolist()
        [[inf, 7.5]]
    """
    x, along = numbers("x", x), numbers("along", along)
    check_finite("x", x)
    check_finite("along", along)
    start = jnp.broadcast_to(x[:, None], along.shape)
    whose = jnp.broadcast_to(jnp.asarray(on)[:, None], along.shape[:2])
    return nearest(scene, start.reshape(-1, 3), along.reshape(-1, 3), whose.ravel()).t.reshape(
        along.shape[:2]
    )


# --- densities -----------------------------------------------------------------------------------


def radians_per_pixel(camera: Pinhole, p: ArrayLike, side: RealLike) -> Float[Array, "*n"]:
    """Square root of a pixel's solid angle: `side gamma^(1/2) / (gamma^2 + p^2)^(3/4)` [rad].

    Times cycles per radian it gives cycles per pixel; off the axis a pixel is narrower along the
    radius than across it, by `sqrt(1 + p^2 / gamma^2)`.

    Args:
        camera: the eye.
        p: image coordinates, shape (..., 2).
        side: of a pixel, a number [unit of the image].

    Example:
        >>> import numpy as np
        >>> from firstorder.bandwidth import radians_per_pixel
        >>> from firstorder.imaging import pinhole
        >>> camera = pinhole((0.0, 0.0, 4.0), (0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0), gamma=2.0)
        >>> radians_per_pixel(camera, np.zeros((1, 2)), 0.01).tolist()
        [0.005]
    """
    gamma, p = camera.gamma, as_float(p)
    return as_float(side) * jnp.sqrt(gamma) / (gamma**2 + jnp.sum(p * p, -1)) ** 0.75


def sampling_density(
    bandwidth: Numbers, *, power: float = 2.0, even: float = 0.1, limit: float = NYQUIST
) -> Float[np.ndarray, "*n"]:
    """Samples in proportion to a power of the bandwidth, and some everywhere.

    2 is Nyquist's rate in both directions of an image. Errors of linear interpolation fall as
    `B^2 / density`, and their sum of squares is least for `B^(4/3)`
    (`C.bandwidth.sampling_density`).

    Args:
        bandwidth: at each pixel, infinity where it has no end [cycles per pixel].
        power: of the bandwidth.
        even: share of the samples that is spread evenly, in [0, 1].
        limit: above which a bandwidth counts no more [cycles per pixel].

    Returns:
        With the mean 1.

    Raises:
        ValueError: for a bandwidth or power that is negative or NaN, or a limit that is not
            positive.

    Example:
        >>> import numpy as np
        >>> from firstorder.bandwidth import sampling_density
        >>> sampling_density(np.array([0.1, 0.2]), even=0.0).tolist()
        [0.4, 1.6]
    """
    check_between("bandwidth", bandwidth, 0.0, np.inf)
    for name, number in (("power", power), ("limit", limit)):
        check_finite(name, number)
    check_not_negative("power", power)
    check_positive("limit", limit)
    if not 0.0 <= even <= 1.0:
        raise ValueError(f"Argument `even` must lie in [0, 1], but is {even}.")
    raised = np.minimum(np.asarray(bandwidth, float), limit) ** power
    mean = float(np.mean(raised))
    own = raised / mean if mean > 0.0 else np.ones_like(raised)
    return even + (1.0 - even) * own
