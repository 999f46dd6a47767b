"""Shadow rays per pixel, from the rates at which replicas miss the filter.

E11's two rates are samples for each metre along the receiver and along the lamp, on either axis; a
pixel of the side p under a lamp of half edges A, B takes `(Omega_x Omega_y)^2 p^2 (2 A) (2 B)`.
The wedge is cut where it leaves the lamp's band limit: `Omega_x = 2 Omega_y_max / a`; and
`Omega_y = Omega_y_max (b/a - 1)`, the corrected equation 18. So pixels with blockers close to them
or at very different depths want most, and those with blockers at a single depth none at all.

Measured, at equal totals: rays in that proportion do worse than as many for every pixel. On the
ground of our stand-in for E11's complex scene (`gathering` of the figures' `e11.shared.space`, 96 x
96, 2 rays a pixel, 2 cycles for each diameter of the lamp, bounds from 2 rays of another seed, a
quarter of the rays spread evenly; three seeds, no figure) the RMS error is 1.5 to 1.8 times as
large, with the square root of it 0.9 to 1.0 times, and 0.60 to 0.65 times with an even share for
all pixels that have blockers. The rates say where replicas meet, not how much light they bring; few
pixels near blockers want nearly all rays, and noise falls with rays alone.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

from firstorder._argument_checks import (
    check_between,
    check_broadcast,
    check_count,
    check_inside,
    check_not_negative,
    check_positive,
    check_shape,
)

Numbers = Float[np.ndarray, " m"]


def rays_per_pixel(
    d1: Numbers | float,
    near: Numbers | float,
    far: Numbers | float,
    Omega_y: float | int,
    pixel: float,
    half: Float[np.ndarray, "2"],
    margin: float = 0.06,
) -> Numbers:
    """Rays for each pixel that keep replicas off the filter; 0 without blockers.

    Args:
        d1: depth of the receivers below the lamp [m].
        near: depth of the first blockers [m].
        far: depth of the last ones [m].
        Omega_y: band limit on the lamp [cycles/m].
        pixel: side of a pixel on the receiver [m].
        half: half edges of the lamp [m].
        margin: blockers nearer to the receiver than this share of d1 count as that near.

    Raises:
        ValueError: if `d1`, `pixel`, `Omega_y` or a depth of blockers that are there is not
            positive, `half` is negative, `margin` is not between 0 and 1, or shapes do not fit.

    Reference: E11 App. B, eqs. 17-18 (the latter corrected, see `rates`).

    Example:
        >>> import numpy as np
        >>> from firstorder.shadowfield import rays_per_pixel
        >>> one = np.ones(1)
        >>> found = rays_per_pixel(one, one / 3, 2 * one / 3, 1.0, 0.1, np.ones(2))
        >>> found.round(3).tolist()  # (4 * 3)^2 / 25
        [5.76]
    """
    check_positive("Omega_y", Omega_y)
    check_positive("pixel", pixel)
    check_not_negative("half", half)
    check_shape("half", np.asarray(half), (2,))
    check_positive("d1", d1)
    d1, near, far = (np.asarray(a, float) for a in (d1, near, far))
    check_shape("far", far, near.shape)
    if near.ndim:
        check_broadcast("d1", d1, near.shape)
    check_inside("margin", margin, 0.0, 1.0)
    some = np.isfinite(near)
    check_positive("near", np.where(np.isposinf(near), 1.0, near))
    check_positive("far", np.where(some, far, 1.0))
    last = np.minimum(np.where(some, far, 0.5 * d1) / d1, 1.0 - margin)
    first = np.minimum(np.where(some, near, 0.5 * d1) / d1, last)
    a, b = 1.0 / last - 1.0, 1.0 / first - 1.0
    rates = (2.0 * Omega_y / a) * (Omega_y * (b / a - 1.0))
    return np.where(some, rates**2 * pixel**2 * 4.0 * np.prod(half), 0.0)


def distribute_rays(
    share: Numbers, total: int, seed: int = 0, least: float = 0.25
) -> Int[np.ndarray, " m"]:
    """Whole numbers of rays for pixels, in proportion to what they need, with a given sum.

    Args:
        share: what each pixel needs, on any scale (`rays_per_pixel`).
        total: of rays.
        seed: of the random numbers by which shares of a ray are rounded.
        least: share of the rays that is spread evenly: blockers that nobody knows are met by these.

    Raises:
        ValueError: if there is no share, or one is negative or no number.

    Example:
        >>> import numpy as np
        >>> from firstorder.shadowfield import distribute_rays
        >>> distribute_rays(np.array([0.0, 1.0, 1.0]), 12, least=0.25).tolist()
        [1, 6, 5]
    """
    check_count("total", total)
    check_between("least", least, 0.0, 1.0)
    check_not_negative("share", share)
    share = np.asarray(share, float)
    if share.ndim != 1 or not len(share):
        raise ValueError(
            f"Argument `share` must hold a number for each pixel, but has shape {share.shape}."
        )
    whole = np.sum(share)
    even = np.full(len(share), 1.0 / len(share))
    part = least * even + (1.0 - least) * (share / whole if whole > 0.0 else even)
    # One uniform number shifts all thresholds: each count is its share rounded up or down.
    ends = np.cumsum(part) * total
    steps = np.floor(np.r_[0.0, ends] + np.random.default_rng(seed).random())
    counts = np.diff(steps).astype(int)
    counts[-1] += total - int(counts.sum())
    return np.maximum(counts, 0)
