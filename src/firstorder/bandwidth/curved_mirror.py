"""Angular bandwidth of a curved glossy mirror at the eye: D05 §6.2 with every term it drops.

The rates follow from the band limits of `bandwidth`, carried through the reflection; beside them
stand the criteria as they are printed.
"""

from __future__ import annotations

import functools

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from firstorder._argument_checks import (
    check_between,
    check_finite,
    check_not_negative,
    check_one,
    check_positive,
    check_shape,
    nan_unless,
)
from firstorder.bandwidth._spectral_norm import reach, spectral_norm
from firstorder.typing import RealLike, Scalar, as_float


def glossy_bandwidth(
    cutoff: RealLike, d: RealLike, kappa: RealLike, cos_view: RealLike, factor: RealLike = 0.0
) -> Float[Array, "..."]:
    """Angular bandwidth, at the eye, of a distant environment in a curved glossy mirror.

    `B = |1 - 2 kappa d / (n.v)| cutoff + |kappa| d / (n.v) factor`: the 1 is the eye turning, the 2
    the mirror turning (once into its frame, once out), `1 / (n.v)` the footprint. kappa > 0 is a
    valley (conventions): a concave mirror subtracts, down to nothing at its focus
    `d = (n.v) / (2 kappa)`, and a convex one always adds.

    Valid pointwise and exactly, off any smooth mirror, with the curvature, distance and angle of
    the point that is seen; over a pixel take the largest. For a curvature of unknown sign pass
    `-abs(kappa)`, which is the larger of the two. Wrong for near light (see `occluded_bandwidth`
    for blockers). Arguments are numbers, or arrays that broadcast.

    Args:
        cutoff: angular frequency at which the lobe, or the environment if it ends before, stops; in
            cycles per radian.
        d: distance from the eye to the mirror along the ray, in metres.
        kappa: curvature dn/dx in the plane of incidence, in radians per metre.
        cos_view: `n.v`, in (0, 1].
        factor: band of what multiplies the light before the lobe, `1 / (2 pi)` for the cosine of
            incidence.

    Returns:
        Largest frequency in cycles per radian of the eye's angle.

    Raises:
        ValueError: if an argument lies outside its range; traced ones give NaN.

    Reference: D05 §6.2, which prints `d (2k / n.v) cutoff` (eq. 20, `glossy_criterion`): too small
    for every convex mirror.

    Example:
        >>> from firstorder.bandwidth import glossy_bandwidth
        >>> glossy_bandwidth(3.0, 2.0, 0.0, 1.0).item()  # a flat mirror shows it as it is
        3.0
        >>> glossy_bandwidth(3.0, 2.0, 0.25, 1.0).item()  # the eye at the focus
        0.0
    """
    c, shear = _footprint(d, cos_view)
    valid = c & _bands(kappa, cutoff=cutoff, factor=factor)
    bend = 2.0 * as_float(kappa) * shear
    extra = reach(jnp.abs(as_float(kappa)) * shear, factor)
    return nan_unless(valid, reach(jnp.abs(1.0 - bend), cutoff) + extra)


def occluded_bandwidth(
    cutoff: RealLike,
    d: RealLike,
    kappa: RealLike,
    cos_view: RealLike,
    depth: RealLike,
    cos_edge: RealLike | None = None,
    light: RealLike = 0.0,
    factor: RealLike = 0.0,
) -> Float[Array, "..."]:
    """Angular bandwidth, at the eye, of an environment behind an edge in a curved glossy mirror.

    `B' = |1 - (2 kappa - s) d / (n.v)| cutoff + (s light + |s - kappa| factor) d / (n.v)` with
    `s = cos_edge / depth`, by which angle the edge wanders per metre of mirror. In the mirror
    direction `cos_edge = n.v`, and the edge adds `d / depth`. The term in `light` is no blur:
    a sharp shadow of a small lamp stays sharp on the dullest surface. Arguments are numbers, or
    arrays that broadcast.

    Args:
        cutoff: as in `glossy_bandwidth`.
        d: as in `glossy_bandwidth`.
        kappa: as in `glossy_bandwidth`.
        cos_view: as in `glossy_bandwidth`.
        depth: distance from the mirror to the blocker's edge along the light, in metres.
        cos_edge: cosine between the normal and the direction to the edge; `cos_view` if left out.
        light: angular bandwidth of the light that the edge cuts, in cycles per radian.
        factor: as in `glossy_bandwidth`.

    Returns:
        Largest frequency in cycles per radian of the eye's angle.

    Raises:
        ValueError: if an argument lies outside its range; traced ones give NaN.

    Reference: D05 §6.2, which prints `d (1 / depth + 2k) / (n.v) cutoff` (eq. 21,
    `occluded_criterion`).

    Example:
        >>> from firstorder.bandwidth import occluded_bandwidth
        >>> occluded_bandwidth(3.0, 2.0, 0.0, 0.5, 1.0).item()  # flat: the edge's image is 3 m away
        9.0
    """
    check_positive("depth", depth)
    cos_edge = cos_view if cos_edge is None else cos_edge
    check_between("cos_edge", cos_edge, 0.0, 1.0)
    c, shear = _footprint(d, cos_view)
    valid = c & _bands(kappa, cutoff=cutoff, light=light, factor=factor)
    depth, kappa, cos_edge = as_float(depth), as_float(kappa), as_float(cos_edge)
    valid = valid & (depth > 0) & (cos_edge >= 0) & (cos_edge <= 1)
    s = cos_edge / depth
    blur = reach(jnp.abs(1.0 - (2.0 * kappa - s) * shear), cutoff)
    sharp = reach(s * shear, light) + reach(jnp.abs(s - kappa) * shear, factor)
    return nan_unless(valid, blur + sharp)


def glossy_bandwidth_in_space(
    cutoff: RealLike, d: RealLike, S: ArrayLike, cos_view: RealLike
) -> Scalar:
    """Angular bandwidth, at the eye, of a distant environment in a curved mirror in space.

    `B = |I - 2 d (S_11 / c, S_12; S_12, S_22 c)| cutoff` with `c = n.v` and the spectral norm,
    for a lobe that is cut at the same frequency in every direction; first axis in the plane of
    incidence, second across it, where the footprint is not stretched and the mirror turns the light
    less. Both effects are smaller than `1 / (n.v)`, so
    `B <= (1 + 2 d max|curvature| / (n.v)) cutoff`.

    Args:
        cutoff: a number, as in `glossy_bandwidth` [cycles/rad].
        d: a number, as in `glossy_bandwidth` [m].
        S: shape operator -dn in the tangent plane, shape (2, 2) (conventions, Space: a sphere has
            -1/R).
        cos_view: `n.v`, a number in (0, 1].

    Returns:
        Largest frequency in cycles per radian, over all directions of the image.

    Raises:
        ValueError: if an argument lies outside its range; traced ones give NaN.

    Reference: D05 §6.2, which takes the larger principal curvature and drops the 1.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.bandwidth import glossy_bandwidth_in_space
        >>> glossy_bandwidth_in_space(1.0, 3.0, -jnp.eye(2) / 2.0, 1.0).item()
        4.0
    """
    S = as_float(S)
    check_shape("S", S, (2, 2))
    for name, number in (("cutoff", cutoff), ("d", d), ("cos_view", cos_view)):
        check_one(name, number)
    c, shear = _footprint(d, cos_view)
    valid = c & _bands(S, "S", cutoff=cutoff)
    cos = as_float(cos_view)
    stretch = jnp.stack([jnp.ones_like(cos), cos])
    turn = 2.0 * shear * S * stretch * stretch[:, None]
    J = jnp.eye(2, dtype=turn.dtype) - turn
    return nan_unless(valid, reach(spectral_norm(J), cutoff))


def glossy_criterion(
    cutoff: RealLike, d: RealLike, kappa: RealLike, cos_view: RealLike
) -> Float[Array, "..."]:
    """The sampling criterion for glossy mirrors as D05 prints it; not a bound.

    `B = d (2 |k| / n.v) cutoff`. Wrong when the eye's own turn matters: it is smaller than
    `glossy_bandwidth` for every convex mirror, and within 10 % of it only where
    `2 |k| d / n.v >= 9` (convex) or `>= 11` (concave); `d` itself being large, in whatever unit,
    says nothing. Arguments are those of `glossy_bandwidth`: numbers, or arrays that broadcast, in
    cycles per radian, metres and radians per metre.

    Raises:
        ValueError: if an argument lies outside its range; traced ones give NaN.

    Reference: D05 §6.2, eq. 20; R07 §9.1, which takes it over.

    Example:
        >>> from firstorder.bandwidth import glossy_criterion
        >>> glossy_criterion(3.0, 2.0, 0.0, 1.0).item()  # a flat mirror, said to show nothing
        0.0
    """
    c, shear = _footprint(d, cos_view)
    c = c & _bands(kappa, cutoff=cutoff)
    return nan_unless(c, reach(2.0 * jnp.abs(as_float(kappa)) * shear, cutoff))


def occluded_criterion(
    cutoff: RealLike, d: RealLike, kappa: RealLike, cos_view: RealLike, depth: RealLike
) -> Float[Array, "..."]:
    """The sampling criterion for glossy mirrors beside a blocker as D05 prints it; not a bound.

    `B' = d / (n.v) (1 / depth + 2 |k|) cutoff`. Wrong as eq. 20 is, and when the light that the
    edge cuts is itself sharp; at grazing angles it overestimates, for in the mirror direction the
    edge's term has no `1 / (n.v)`. Arguments are those of `occluded_bandwidth`: numbers, or arrays
    that broadcast, in cycles per radian, metres and radians per metre.

    Raises:
        ValueError: if an argument lies outside its range; traced ones give NaN.

    Reference: D05 §6.2, eq. 21.

    Example:
        >>> from firstorder.bandwidth import occluded_criterion
        >>> occluded_criterion(3.0, 2.0, 0.0, 0.5, 1.0).item()
        12.0
    """
    check_positive("depth", depth)
    c, shear = _footprint(d, cos_view)
    c = c & _bands(kappa, cutoff=cutoff)
    depth = as_float(depth)
    slopes = 1.0 / depth + 2.0 * jnp.abs(as_float(kappa))
    return nan_unless(c & (depth > 0), reach(shear * slopes, cutoff))


def _footprint(d: RealLike, cos_view: RealLike) -> tuple[Array, Array]:
    """Metres of mirror per radian of the eye, `d / (n.v)`, and whether the arguments are valid."""
    check_not_negative("d", d)
    check_positive("cos_view", cos_view)
    check_between("cos_view", cos_view, 0.0, 1.0)
    d, cos = as_float(d), as_float(cos_view)
    valid = (d >= 0) & (cos > 0) & (cos <= 1)
    return valid, d / jnp.where(cos > 0, cos, 1.0)


def _bands(curvature: RealLike, name: str = "kappa", **limits: RealLike) -> Array:
    """Whether band limits are not negative; they may be infinite, a curvature may not."""
    check_finite(name, curvature)
    for limit, value in limits.items():
        check_between(limit, value, 0.0, np.inf)
    return functools.reduce(jnp.logical_and, (as_float(v) >= 0 for v in limits.values()))
