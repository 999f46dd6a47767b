"""Sheared filters over the shadow light field, in frequency and in space.

A filter is a parallelogram of frequencies over (x, y): a box, scaled along Omega_x and sheared.
What it is in space follows from the matrix of that map, never from a formula of its own: a point
of energy moves by A, so footprints move by `A^-T`, and kernels are read at `A^T u`.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Bool, Float

from firstorder._argument_checks import (
    check_finite,
    check_not_negative,
    check_one,
    check_positive,
    check_shape,
    is_concrete,
    nan_unless,
)
from firstorder._display import Module
from firstorder.fields.field import Field
from firstorder.numerics._batching import in_batches
from firstorder.shadowfield.plane.light_field import to_two_planes
from firstorder.shadowfield.plane.spectra import Wedge
from firstorder.typing import Scalar, as_float


class RayFilter(Module):
    """Frequencies `|Omega_y| <= Omega_y_max`, `|Omega_x - shear Omega_y| <= width / 2` pass.

    Make one with `sheared_filter` or `axis_aligned_filter`.

    Attributes:
        width: along Omega_x [cycles/m].
        shear: Omega_x per Omega_y, the slope of the filter's middle line.
        Omega_y_max: band limit of the light [cycles/m].
        Omega_pix: band limit of the receiver's pixels [cycles/m].
        margin: width of the soft edge on either side of `width`: all of `width` passes, what is
            farther outside than twice the margin does not; 0 for a sharp edge [cycles/m].

    Raises:
        ValueError: if one is not one real number, a band limit not positive, or a width negative.

    Reference: E11 §4, eq. 10 for the shear.

    Example:
        >>> from firstorder.shadowfield import RayFilter
        >>> RayFilter(2.0, 0.5, 4.0, 8.0).contains(2.0, 4.0).item()  # on the middle line
        True
    """

    width: Scalar = eqx.field(converter=as_float)
    shear: Scalar = eqx.field(converter=as_float)
    Omega_y_max: Scalar = eqx.field(converter=as_float)
    Omega_pix: Scalar = eqx.field(converter=as_float)
    margin: Scalar = eqx.field(converter=as_float, default=0.0)

    def __check_init__(self):
        """Refuse what is no filter."""
        for name, x in vars(self).items():
            check_one(name, x)
        check_finite("shear", self.shear)
        for name in ("Omega_y_max", "Omega_pix"):
            check_positive(name, getattr(self, name))
        for name in ("width", "margin"):
            check_not_negative(name, getattr(self, name))

    @property
    def frequency_matrix(self) -> Float[Array, "2 2"]:
        """A: takes the simple filter's frequencies to this one's, a scale and then a shear."""
        zero, one = jnp.zeros_like(self.width), jnp.ones_like(self.width)
        scale = jnp.stack([0.5 * self.width / self.Omega_pix, zero])
        return jnp.stack([jnp.stack([one, self.shear]), jnp.stack([zero, one])]) @ jnp.stack(
            [scale, jnp.stack([zero, one])]
        )

    @property
    def primal_matrix(self) -> Float[Array, "2 2"]:
        """`A^-T`: takes the simple filter's footprint over (x, y) to this one's.

        Without end where blockers at a single depth leave no width.
        """
        scale = 2.0 * self.Omega_pix / self.width
        zero, one = jnp.zeros_like(scale), jnp.ones_like(scale)
        rows = jnp.stack([scale, zero]), jnp.stack([-self.shear * scale, one])
        return jnp.stack(rows)

    @property
    def primal_scale(self) -> Scalar:
        """Length of the footprint along x over that of a pixel's; below 1 nothing is gained.

        Reference: E11 eq. 9.
        """
        return self.primal_matrix[0, 0]

    @property
    def primal_shear(self) -> Scalar:
        """The footprint's shear in y per x, after the scale.

        Reference: E11 eq. 10.
        """
        return -self.shear

    def light_matrix(self, d1) -> Float[Array, "2 2"]:
        """Takes the simple filter's footprint over (x, y) to this one's over (y, v).

        Reference: E11 eqs. 11-12, Fig. 6 (d).
        """
        return to_two_planes(d1).M @ self.primal_matrix

    @property
    def area(self) -> Scalar:
        """Area of the filter in frequency; half of its soft edges, which passes [cycles^2/m^2]."""
        return 2.0 * self.Omega_y_max * (self.width + 2.0 * self.margin)

    def corners(self) -> Float[Array, "4 2"]:
        """The four corners in frequency, in turn, of all that passes, soft edges included."""
        signs = jnp.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
        box = signs * jnp.stack([self.Omega_pix, self.Omega_y_max])
        return (box @ self.frequency_matrix.T).at[:, 0].add(2.0 * self.margin * signs[:, 0])

    def contains(self, Omega_x, Omega_y) -> Bool[Array, "..."]:
        """Whether frequencies pass undimmed, inside of soft edges."""
        across = jnp.abs(Omega_x - self.shear * Omega_y) <= 0.5 * self.width
        return across & (jnp.abs(Omega_y) <= self.Omega_y_max)

    def across(self, x) -> Float[Array, "..."]:
        """The kernel along x alone: `W sinc(W x)`, under a Gaussian if the edge is soft."""
        x = as_float(x)
        W = self.width + 2.0 * self.margin
        # The edge lies `margin` outside of `width`, blurred by a Gaussian of a sixth of that.
        taper = jnp.exp(-0.5 * (2.0 * np.pi * self.margin / 6.0 * x) ** 2)
        return W * jnp.sinc(W * x) * taper

    def kernel(self, x, y) -> Float[Array, "..."]:
        """The filter in space: `|det A| k(A^T u)`, k the simple filter's product of sincs."""
        high = 2.0 * self.Omega_y_max
        return self.across(x) * high * jnp.sinc(high * (y + self.shear * x))


def sheared_filter(d1, d2_min, d2_max, Omega_y_max, Omega_pix, margin=0.0) -> RayFilter:
    """The filter that covers the wedge of the blockers up to the band limit of the light.

    Its corners at `Omega_y = Omega_y_max` are the wedge's: `width = Omega_y_max (1/a - 1/b)` and
    `shear = (1/a + 1/b) / 2` with the wedge's slopes a < b.

    Args:
        d1: distance of the receiver from the light [m].
        d2_min: distance of the nearest blocker from the light [m].
        d2_max: distance of the farthest one [m].
        Omega_y_max: band limit of the light [cycles/m].
        Omega_pix: band limit of the pixels on the receiver, half a cycle a pixel [cycles/m].
        margin: soft edge; blockers at a single depth need one, for their wedge has no width.

    Valid when: all blockers are nearer to the light than the receiver is. Wrong, and refused, when
    `d1 <= d2_max`: the wedge then holds the axis Omega_y = 0 and no shear covers it; use
    `axis_aligned_filter`, or split the blockers.

    Raises:
        ValueError: if `d1` is not beyond the blockers, they are at a single depth and there is no
            margin, or a number is not positive. For traced arguments: a filter of NaN.

    Reference: E11 §4, eqs. 9-10, Fig. 5.

    Example:
        >>> from firstorder.shadowfield import sheared_filter
        >>> k = sheared_filter(1.0, 0.25, 0.5, Omega_y_max=2.0, Omega_pix=16.0)
        >>> round(float(k.primal_scale), 3), round(float(k.primal_shear), 3)
        (24.0, -0.667)
    """
    wedge = Wedge(d2_min, d2_max)
    for name, value in (("d1", d1), ("Omega_y_max", Omega_y_max), ("Omega_pix", Omega_pix)):
        check_positive(name, value)
    check_not_negative("margin", margin)
    _check_beyond(
        d1,
        d2_max,
        "a receiver among the blockers has no sheared filter, use `axis_aligned_filter`.",
    )
    _check_depths_apart(d2_min, d2_max, margin)
    d1, high, Omega_pix, margin = (as_float(z) for z in (d1, Omega_y_max, Omega_pix, margin))
    a, b = wedge.slopes(d1)
    ok = (a > 0) & (b >= a) & ((b > a) | (margin > 0))
    ok &= (high > 0) & (Omega_pix > 0) & (margin >= 0)
    a, b = jnp.where(ok, a, 1.0), jnp.where(ok, b, 2.0)
    width = high * (1.0 / a - 1.0 / b)
    return RayFilter(
        nan_unless(ok, width), nan_unless(ok, 0.5 * (1.0 / a + 1.0 / b)), high, Omega_pix, margin
    )


def axis_aligned_filter(Omega_y_max, Omega_pix, margin=0.0) -> RayFilter:
    """The axis-aligned filter: all frequencies that light and pixels can show.

    Args:
        Omega_y_max: band limit of the light [cycles/m].
        Omega_pix: band limit of the receiver's pixels [cycles/m].
        margin: width of the soft edge [cycles/m].

    Raises:
        ValueError: if a band limit is not positive, or the margin is negative. For traced
            arguments: a width of NaN.

    Reference: E11 Fig. 5 (a).

    Example:
        >>> from firstorder.shadowfield import axis_aligned_filter
        >>> axis_aligned_filter(2.0, 8.0).width.item()
        16.0
    """
    for name, value in (("Omega_y_max", Omega_y_max), ("Omega_pix", Omega_pix)):
        check_positive(name, value)
    check_not_negative("margin", margin)
    high, Omega_pix, margin = (as_float(z) for z in (Omega_y_max, Omega_pix, margin))
    width = nan_unless((high > 0) & (Omega_pix > 0) & (margin >= 0), 2.0 * Omega_pix)
    return RayFilter(width, jnp.zeros_like(Omega_pix), high, Omega_pix, margin)


def reconstruct_irradiance(
    filter: RayFilter,
    light: Field,
    x: Float[ArrayLike, " m"],
    samples: tuple[ArrayLike, ArrayLike, ArrayLike],
    cell: float | None = None,
    block: int = 64,
) -> Float[Array, " m"]:
    """Irradiance from samples of visibility, by the filter in space.

    `h(x) = cell sum_i w_i f_i`, `w_i = k(x - x_i) l(y_i - shear (x - x_i))`: what the kernel, with
    the light integrated over its sinc along y, becomes for a light below the band limit. Each ray
    is slid along the blockers' direction to the receiver that is asked for, where the light
    weighs it.

    Args:
        filter: sheared or simple.
        light: intensity l over `PLANE`; its spectrum ends below `Omega_y_max`.
        x: where on the receiver [m].
        samples: x_i, y_i and the visibility f_i of the rays, an array of one axis each. Rays to
            points beyond the ends of the light count: a sheared filter reads them.
        cell: area that one sample of a regular grid stands for [m^2]. Left out, for scattered
            samples, the weights are normalised, as E11 §5 does, and the result is
            `sum w f / sum w`, the share of the light that arrives: h divided by int l.
        block: receivers that are done at once.

    Returns:
        h, or its share of the light [intensity times m, or no unit].

    Raises:
        ValueError: if `block` or `cell` is not positive, or samples are not equally many.

    Reference: E11 §4-5, Figs. 6, 8.

    Example:
        >>> import numpy as np
        >>> from firstorder.fields import Constant
        >>> from firstorder.shadowfield import PLANE, axis_aligned_filter, reconstruct_irradiance
        >>> x, y = (a.ravel() for a in np.meshgrid(np.linspace(-1, 1, 33), np.linspace(-1, 1, 9)))
        >>> k, even = axis_aligned_filter(1.0, 4.0), Constant(1.0, PLANE)
        >>> h = reconstruct_irradiance(k, even, np.zeros(1), (x, y, np.ones(x.size)))
        >>> round(h[0].item(), 9)  # nothing is hidden
        1.0
    """
    xi, yi, fi = (as_float(s) for s in samples)
    for a in (yi, fi):
        check_shape("samples", a, xi.shape)
    if cell is not None:
        check_positive("cell", cell)
    weighed = jax.vmap(light.at)

    def one(x):
        w = filter.across(x - xi) * weighed((yi - filter.shear * (x - xi))[:, None])
        total = jnp.sum(w * fi)
        return total * cell if cell is not None else total / jnp.sum(w)

    return in_batches(one, as_float(x), block)


def _check_beyond(d1, d2_max, otherwise: str) -> None:
    """Refuse a receiver that is not beyond the blockers, with a sentence's end that says why.

    Args:
        d1: distance of the receiver from the light [m].
        d2_max: distance of the farthest blocker from the light [m].
        otherwise: what follows where it is not.

    Raises:
        ValueError: if both are concrete, and it is not.
    """
    if is_concrete((d1, d2_max)) and np.any(np.asarray(d1) <= np.asarray(d2_max)):
        raise ValueError(
            f"Argument `d1` must be greater than `d2_max` = {d2_max}, but is {d1}: {otherwise}"
        )


def _check_depths_apart(d2_min, d2_max, margin) -> None:
    """Refuse a sharp filter for blockers at a single depth."""
    if not is_concrete((d2_min, d2_max, margin)):
        return
    if np.any(np.asarray(d2_min) == np.asarray(d2_max)) and not np.all(np.asarray(margin) > 0):
        raise ValueError(
            "Argument `margin` must be positive for blockers at a single depth, but is 0.0."
        )
