"""BRDFs of fine relief, in the frequencies of the light: the normals that the eye sees."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Complex

from firstorder._argument_checks import (
    check_below,
    check_between,
    check_coordinates,
    check_finite,
    check_inside,
    check_not_negative,
    check_positive,
    check_unit,
    nan_unless,
)
from firstorder.typing import RealLike, as_float

_PLACES = 512  # on a quarter of a wave; its harmonics fall below rounding before that
_MOST_TURNS = 200.0  # radians of phase by which a wave may modulate light


def relief_transfer(
    Omega: RealLike, slope: RealLike, view: RealLike = 0.0
) -> Complex[Array, "..."]:
    """Transfer of the BRDF of fine waves: the share of each angular frequency that it keeps.

    `T(Omega) = mean of exp(4 pi i Omega n) (1 + h' tan view)` over a wave, with `h' = m cos(phase)`
    and `n = arctan h'`: the transform of the mirrored normals' distribution, each by the area that
    it shows to the eye. The radiance towards the eye is `T(Omega)` times that of a flat mirror, and
    times the transform of the lobe if there is one, for these are convolutions.

    Near zero it is `1 + 2 pi i Omega m^2 tan view`: fine waves turn the mirror by half of
    `m^2 tan view`. Where slopes are small it is `J_0(4 pi Omega m)` and `i m tan view J_1` of it.

    Args:
        Omega: angular frequency of the light, numbers or an array [cycles per rad].
        slope: the largest, `m = 2 pi f a`, with `m |tan view| < 1`: the eye sees all of the waves.
        view: angle from the base's normal to the eye [rad].

    Raises:
        ValueError: if an argument lies outside its range, or `4 pi Omega arctan(m)` is above 200;
            traced ones give NaN.

    Reference: D05 §7.

    Example:
        >>> from firstorder.bandwidth import relief_transfer
        >>> print(f"{relief_transfer(0.5, 0.1).real:.3f} {relief_transfer(2.0, 0.1).real:.3f}")
        0.904 -0.052
    """
    check_finite("Omega", Omega)
    check_not_negative("slope", slope)
    check_inside("view", view, -0.5 * np.pi, 0.5 * np.pi)
    Omega, slope, view = jnp.broadcast_arrays(*(as_float(a) for a in (Omega, slope, view)))
    shown, turns = slope * jnp.abs(jnp.tan(view)), 4.0 * np.pi * Omega * jnp.arctan(slope)
    check_below("slope * |tan(view)|", shown, 1.0)
    check_between("4 pi Omega arctan(slope)", jnp.abs(turns), 0.0, _MOST_TURNS)
    rise, share = _quarter(slope[..., None])
    turned = 4.0 * np.pi * Omega[..., None] * jnp.arctan(rise)
    even = jnp.mean(share * jnp.cos(turned), -1)
    odd = jnp.mean(share * rise * jnp.sin(turned), -1)
    mean = even + 1j * jnp.tan(view) * odd
    valid = (slope >= 0) & (shown < 1) & (jnp.abs(view) < 0.5 * np.pi)
    valid &= jnp.abs(turns) <= _MOST_TURNS
    return mean * nan_unless(valid, jnp.ones_like(slope))


def shape_transfer(
    Omega: RealLike, slopes: ArrayLike, view: RealLike = 0.0
) -> Complex[Array, "..."]:
    """Transfer of the BRDF of fine relief in flatland: the share that it keeps of each frequency.

    `T(Omega) = mean of exp(4 pi i Omega n) (1 + h' tan view)` over a period, `n = arctan h'`, as in
    `relief_transfer`, but of slopes that are given.

    Args:
        Omega: angular frequencies of the light, numbers or an array [cycles per rad].
        slopes: h' at places that lie evenly over a period, shape (n,).
        view: angle from the base's normal to the eye [rad]; it sees all places,
            `|h' tan view| < 1`.

    Raises:
        ValueError: if an argument lies outside its range; traced ones give NaN.

    Reference: D05 §7.

    Example:
        >>> import numpy as np
        >>> from firstorder.bandwidth import shape_transfer
        >>> roof = np.array([0.1, 0.1, 0.1, -0.3])  # long sides and short ones
        >>> print(f"{shape_transfer(1.0, roof, 0.5):.3f}")
        0.066+0.855j
    """
    check_finite("Omega", Omega)
    check_finite("slopes", slopes)
    check_inside("view", view, -0.5 * np.pi, 0.5 * np.pi)
    Omega, rise, view = as_float(Omega), as_float(slopes), as_float(view)
    seen = 1.0 + rise * jnp.tan(view)
    _check_seen(seen)
    phase = 4.0 * np.pi * Omega[..., None] * jnp.arctan(rise)
    valid = jnp.all(seen > 0.0) & (jnp.abs(view) < 0.5 * np.pi)
    return nan_unless(valid, jnp.mean(seen * jnp.exp(1j * phase), -1))


def shape_transfer_in_space(
    Omega: ArrayLike, slopes: ArrayLike, to_eye: ArrayLike
) -> Complex[Array, "..."]:
    """Transfer of the BRDF of fine relief in space: what it makes of waves over directions.

    Light `exp(2 pi i Omega . w)` of directions w comes to the eye from the flat mirror's direction
    `w_0 = 2 e_z z - e`, times

        T(Omega) = mean of exp(2 pi i Omega . (w - w_0)) (1 - V . grad h),  V = (e_x, e_y) / e_z

    over a period, with w what the normal `(-grad h, 1)` mirrors to the eye e, and each normal by
    the area that it shows. Seen aslant it depends on the azimuth.

    Args:
        Omega: frequencies of the light over directions, shape (..., 3) [cycles per rad].
        slopes: `grad h = (h_x, h_y)` at places that lie evenly over a period, shape (..., 2).
        to_eye: unit vector e, shape (3,); it sees all places, `V . grad h < 1`.

    Raises:
        ValueError: if an argument lies outside its range; traced ones give NaN.

    Reference: D05 §7.

    Example:
        >>> import numpy as np
        >>> from firstorder.bandwidth import shape_transfer_in_space
        >>> roofs = 0.1 * np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
        >>> Omega, to_eye = np.array([0.5, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
        >>> print(f"{shape_transfer_in_space(Omega, roofs, to_eye).real:.3f}")
        0.906
    """
    check_coordinates("Omega", Omega)
    check_coordinates("to_eye", to_eye)
    check_finite("Omega", Omega)
    check_finite("slopes", slopes)
    e, rise = as_float(to_eye), as_float(slopes)
    if rise.shape[-1:] != (2,):
        raise ValueError(f"Argument `slopes` must end with two axes, but has shape {rise.shape}.")
    check_unit("to_eye", e)
    check_positive("to_eye[2]", e[2])
    up = jnp.where(e[2] > 0.0, e[2], 1.0)
    rise = rise.reshape(-1, 2)
    seen = 1.0 - rise @ e[:2] / up
    _check_seen(seen)
    normal = jnp.concatenate([-rise, jnp.ones_like(rise[:, :1])], -1)
    square = jnp.sum(normal**2, -1, keepdims=True)
    w = 2.0 * (normal @ e)[:, None] * normal / square - e
    phase = 2.0 * np.pi * as_float(Omega) @ (w - e * np.array([-1.0, -1.0, 1.0])).T
    valid = jnp.all(seen > 0.0) & (e[2] > 0.0) & (jnp.abs(jnp.sum(e * e) - 1.0) < 1e-3)
    return nan_unless(valid, jnp.mean(seen * jnp.exp(1j * phase), -1))


def _check_seen(seen: Array) -> None:
    """Refuse places of which the eye sees the back, or nothing."""
    check_positive("1 - slopes . V", seen)


def _quarter(slope: Array) -> tuple[Array, Array]:
    """Slopes h' of places on a quarter of a wave, up to the largest, and their shares of it.

    `h' = sinh(S sin(t))` at even t, with `sinh(S)` the largest: the normals of steep waves turn
    within a small share of the wave, and there the places lie close.
    """
    most = jnp.arcsinh(slope)
    s = most * np.sin(0.5 * np.pi * (np.arange(_PLACES) + 0.5) / _PLACES)
    # sinh(S)^2 - sinh(s)^2 = sinh(S - s) sinh(S + s), a difference without its loss of digits.
    share = jnp.cosh(s) / jnp.sqrt(_sinh_over(most - s) * _sinh_over(most + s))
    return jnp.sinh(s), share


def _sinh_over(x: Array) -> Array:
    """`sinh(x) / x`, by a series where its derivatives are differences of large numbers."""
    near = jnp.abs(x) < 0.1
    y = jnp.where(near, x, 0.0) ** 2
    series = 1.0 + y / 6.0 * (1.0 + y / 20.0 * (1.0 + y / 42.0 * (1.0 + y / 72.0)))
    far = jnp.where(near, 1.0, x)
    return jnp.where(near, series, jnp.sinh(far) / far)
