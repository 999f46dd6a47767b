"""Refinement priorities of an image's squares: metrics for `reconstruction.quadtree`.

A metric takes squares, with what was found in their middles and beside them, to numbers; the
largest is split next. All are densities times an area, so that they fall as squares are cut.

R07 §9.1 uses the size of the image's gradient. It names shadow gradients and the second order as
missing: the first is part of the gradient that the shading function returns, or is not; the second
is `by_hessian`, or `by_hessian_differences` without a second derivative.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from firstorder._argument_checks import check_not_negative, check_positive, check_shape
from firstorder._display import in_print

Places = Float[np.ndarray, "n 2"]
Numbers = Float[np.ndarray, " n"]


class ShadedSamples(NamedTuple):
    """Values, gradients and further data that a shading function returns.

    Attributes:
        value: radiance [W/(m^2 sr)].
        gradient: per pixel, or None if it is not computed.
        more: anything else that a metric wants, an array with a row per place.

    Example:
        >>> import numpy as np
        >>> from firstorder.reconstruction import ShadedSamples
        >>> ShadedSamples(np.array([0.5, 1.0])).gradient is None
        True
    """

    value: Numbers
    gradient: Float[np.ndarray, "n 2"] | None = None
    more: np.ndarray | None = None

    __repr__ = in_print


class QuadtreeCells(NamedTuple):
    """Squares of the quadtree as a metric sees them, with the shading in and beside their middles.

    Attributes:
        size: side lengths [pixels].
        shaded: what the shading function gave.
        differences: central differences between the four that came of one square (of neighbours in
            the first grid): the gradient as it looks without derivatives, per pixel.
        bending: the same differences of the gradients, if there are any: the Hessian as it looks
            with one derivative, made symmetric, per pixel^2.
        variance: of the values of those four, unbiased; in the first grid the mean over the up to
            four such fours that hold a square.

    Example:
        >>> import numpy as np
        >>> from firstorder.reconstruction import QuadtreeCells, ShadedSamples, by_area
        >>> cells = QuadtreeCells(np.array([4.0, 2.0]), ShadedSamples(np.ones(2)), np.zeros((2, 2)))
        >>> by_area(cells).tolist()
        [16.0, 4.0]
    """

    size: Numbers
    shaded: ShadedSamples
    differences: Float[np.ndarray, "n 2"]
    bending: Float[np.ndarray, "n 2 2"] | None = None
    variance: Numbers | None = None

    __repr__ = in_print


Metric = Callable[[QuadtreeCells], Numbers]


# --- metrics: refinement priority of a square -----------------------------------------------------


def by_area(squares: QuadtreeCells) -> Numbers:
    """The square's area: samples spread evenly, as far as halving goes.

    Example:
        >>> import numpy as np
        >>> from firstorder.reconstruction import ShadedSamples, QuadtreeCells, by_area
        >>> by_area(QuadtreeCells(np.array([2.0]), ShadedSamples(np.ones(1)), np.zeros((1,
        ...     2)))).tolist()
        [4.0]
    """
    return squares.size**2


def by_gradient(squares: QuadtreeCells) -> Numbers:
    """`|grad I| h^2`, from the gradient that the shading function computed.

    Raises:
        ValueError: if it computes none.

    Reference: R07 §9.1.

    Example:
        >>> import numpy as np
        >>> from firstorder.reconstruction import ShadedSamples, QuadtreeCells
        >>> from firstorder.reconstruction import by_gradient
        >>> found = ShadedSamples(np.ones(1), np.array([[3.0, 4.0]]))
        >>> by_gradient(QuadtreeCells(np.array([2.0]), found, np.zeros((1, 2)))).tolist()
        [20.0]
    """
    if squares.shaded.gradient is None:
        raise ValueError("Argument `metric` needs gradients, but `shade` returns none.")
    return _norm(squares.shaded.gradient) * squares.size**2


def by_differences(squares: QuadtreeCells) -> Numbers:
    """`|grad I| h^2` from differences of neighbouring samples, as renderers without derivatives do.

    It misses what lies between the samples (R07 Fig. 16).

    Example:
        >>> import numpy as np
        >>> from firstorder.reconstruction import ShadedSamples, QuadtreeCells
        >>> from firstorder.reconstruction import by_differences
        >>> beside = np.array([[3.0, 4.0]])
        >>> by_differences(QuadtreeCells(np.array([2.0]), ShadedSamples(np.ones(1)),
        ...     beside)).tolist()
        [20.0]

    Reference: R07 §9.2.
    """
    return _norm(squares.differences) * squares.size**2


def by_hessian(squares: QuadtreeCells) -> Numbers:
    """`|Hess I| h^3`: the shading function's `more` holds the Hessian, (n, 2, 2) per pixel^2.

    What is read off samples with their planes, or linearly, errs by second derivatives. Exact ones
    with moving shadows come from `jax.hessian` of `space.irradiance`; but a Hessian in the middle
    of a square is zero in a shadow's core and in open light, and knows nothing of a penumbra that
    begins beside it. A floor under a lamp and a ball, 64 x 64 pixels, 5 to 30 % of samples, put
    together linearly: 0.84 to 0.94 of the error by `by_gradient`; by `by_hessian_differences` 0.40
    to 0.63.

    Raises:
        ValueError: if there are none.

    Example:
        >>> import numpy as np
        >>> from firstorder.reconstruction import ShadedSamples, QuadtreeCells
        >>> from firstorder.reconstruction import by_hessian
        >>> found = ShadedSamples(np.ones(1), more=np.array([[[3.0, 0.0], [0.0, 4.0]]]))
        >>> by_hessian(QuadtreeCells(np.array([2.0]), found, np.zeros((1, 2)))).tolist()
        [40.0]
    """
    H = squares.shaded.more
    if H is None or H.shape[1:] != (2, 2):
        raise ValueError("Argument `metric` needs Hessians in `more`, but `shade` returns none.")
    return np.sqrt(np.sum(H**2, axis=(1, 2))) * squares.size**3


def by_hessian_differences(squares: QuadtreeCells) -> Numbers:
    """`|Hess I| h^3`, the Hessian from differences of neighbouring samples' gradients.

    The second order that needs no second derivative, and sees shadows move where gradients do: it
    is the mean Hessian between the samples. In the penumbra of a ball (gradients of
    `shadow_edge_terms`, 48 x 48 nodes) it is off the exact one by 5 % in the median where samples
    are a quarter of the penumbra apart, 15 % at a half and 40 % at all of it; by 90 % where the
    gradients leave out that shadows move.

    Raises:
        ValueError: if the shading function computes no gradients.

    Example:
        >>> import numpy as np
        >>> from firstorder.reconstruction import ShadedSamples, QuadtreeCells
        >>> from firstorder.reconstruction import by_hessian_differences
        >>> H = np.array([[[3.0, 0.0], [0.0, 4.0]]])
        >>> by_hessian_differences(QuadtreeCells(np.array([2.0]), ShadedSamples(np.ones(1)),
        ...     np.zeros((1, 2)), H)).tolist()
        [40.0]
    """
    if squares.bending is None:
        raise ValueError("Argument `metric` needs gradients, but `shade` returns none.")
    return np.sqrt(np.sum(squares.bending**2, axis=(1, 2))) * squares.size**3


def by_tangent_planes(squares: QuadtreeCells) -> Numbers:
    """`(|Hess I| h + |differences - grad I|) h^2`: how far tangent planes miss what is beside them.

    The first is `by_hessian_differences`. The second compares values with gradients: on a smooth
    image it is of the same order, half of the Hessian's step; but where a square is all dark and
    the next one all lit, gradients of both are zero, and values alone know that a shadow's edge
    lies between. R07's scene of meshes under twelve lamps, 17 % of samples, put together linearly:
    0.40 to 0.99 of the error by `by_gradient`; without the second 0.44 to 0.94 under ten of them,
    and 2.4 and 2.6 under two.

    Raises:
        ValueError: if the shading function computes no gradients.

    Example:
        >>> import numpy as np
        >>> from firstorder.reconstruction import QuadtreeCells, ShadedSamples, by_tangent_planes
        >>> flat = ShadedSamples(np.ones(1), np.zeros((1, 2)))
        >>> edge = np.array([[3.0, 4.0]])
        >>> squares = QuadtreeCells(np.array([2.0]), flat, edge, np.zeros((1, 2, 2)))
        >>> by_tangent_planes(squares).tolist()
        [20.0]
    """
    missed = by_hessian_differences(squares)
    return missed + _norm(squares.differences - squares.shaded.gradient) * squares.size**2


def by_variance(squares: QuadtreeCells) -> Numbers:
    """`h^2 V`, V the variance of a square's value and its neighbours': the usual way to refine.

    On a plane it is the square of `by_differences`, up to a factor, so that both split alike: "in
    effect, this is equivalent to estimating the magnitude of the gradient" (R07 §9.2).

    Raises:
        ValueError: if there is no variance.

    Example:
        >>> import numpy as np
        >>> from firstorder.reconstruction import ShadedSamples, QuadtreeCells
        >>> from firstorder.reconstruction import by_variance
        >>> four = QuadtreeCells(np.array([2.0]), ShadedSamples(np.ones(1)), np.zeros((1, 2)), None,
        ...     np.ones(1))
        >>> by_variance(four).tolist()
        [4.0]
    """
    if squares.variance is None:
        raise ValueError("Argument `metric` needs variances of neighbours, but there are none.")
    return squares.variance * squares.size**2


def by_density(squares: QuadtreeCells) -> Numbers:
    """`m h^2` with the shading function's `more` as m, a density of importance, one a place.

    Fit for every heuristic that is given in closed form: D05's band limit, or the product of
    curvature, grazing view and gloss (R07 §9).

    Raises:
        ValueError: if there is none.

    Example:
        >>> import numpy as np
        >>> from firstorder.reconstruction import ShadedSamples, QuadtreeCells
        >>> from firstorder.reconstruction import by_density
        >>> found = ShadedSamples(np.ones(1), more=np.array([3.0]))
        >>> by_density(QuadtreeCells(np.array([2.0]), found, np.zeros((1, 2)))).tolist()
        [12.0]
    """
    m = squares.shaded.more
    if m is None or m.ndim != 1:
        raise ValueError("Argument `metric` needs a density in `more`, but `shade` returns none.")
    return m * squares.size**2


def importance_product(
    turning: Float[np.ndarray, "n 2"],
    share: Float[np.ndarray, "n 2"],
    band: Float[np.ndarray, "n 2"],
    distance: Numbers,
    cosine: Numbers,
    lamp: Numbers,
) -> Numbers:
    """Cheap product of the factors that make images vary; no light is gathered for it (R07 §9).

    `m = z / (n_0 . v) sum over lobes of share (turning + 1 / lamp) band`: how much of the surface a
    pixel covers, how fast the surface turns there, bumps included, or the lamp's direction does,
    and how sharp a lobe can show that. D05's criterion as R07 §9 has it knows neither bumps nor the
    lamp's distance, and takes the sharpest lobe for all.

    Args:
        turning: how fast each lobe turns along the surface, CV of `imaging.ShadedPixels`
            [1/m].
        share: of light that each lobe reflects, albedo and specular.
        band: band limit of each lobe [1/rad].
        distance: from the eye [m].
        cosine: between the base surface's normal and the way to the eye.
        lamp: distance to the nearest lamp [m].

    Returns:
        What `by_density` wants in `more`. Cosines count as 1e-3 at least, so that a surface that is
        seen edge-on has a finite importance.

    Raises:
        ValueError: if shapes do not fit, a number is negative, or a lamp is at no distance. What is
            NaN or infinite, as where nothing is seen, is not looked at.

    Example:
        >>> import numpy as np
        >>> from firstorder.reconstruction import importance_product
        >>> one = np.ones((1, 2))
        >>> importance_product(one, 0.5 * one, one, np.ones(1), np.full(1, 0.5),
        ...     np.ones(1)).tolist()
        [4.0]
    """
    turning, share, band = (np.atleast_1d(a) for a in (turning, share, band))
    distance, cosine, lamp = (np.atleast_1d(a) for a in (distance, cosine, lamp))
    places = (distance.size,)
    for name, a in (("distance", distance), ("cosine", cosine), ("lamp", lamp)):
        check_shape(name, a, places)
    for name, a in (("turning", turning), ("share", share), ("band", band)):
        check_shape(name, a, (*places, turning.shape[-1]))
        check_not_negative(name, _finite(a))
    check_not_negative("distance", _finite(distance))
    check_positive("lamp", _finite(lamp))
    speed = np.sum(share * band * (turning + 1.0 / lamp[:, None]), -1)
    return distance * speed / np.maximum(cosine, 1e-3)


def is_far_light(CDV: Numbers, SV: Numbers, threshold: float) -> Bool[np.ndarray, " n"]:
    """Mask of places whose light may be taken for distant: `CDV > threshold SV`, R07's far light.

    The gradient then loses SV. Of one lobe's gradient along the surface, SV + CDV, that is a share
    of at most `1 / (threshold - 1)`; of an image's gradient it may be more, where the CDV of two
    lobes, or that and the turn of the view, point against each other. What the value loses grows
    with the way to where the light was looked at (`imaging.sky_lights.distant_lamp`).

    Args:
        CDV: curvature-weighted directional variation [per m].
        SV: spatial variation [per m].
        threshold: from 1 up.

    Raises:
        ValueError: if the threshold is below 1.

    Reference: R07 §5.2, `|L_x| << 2 |n_x| |L_theta|`.

    Example:
        >>> import numpy as np
        >>> from firstorder.reconstruction import is_far_light
        >>> is_far_light(np.array([3.0, 30.0]), np.ones(2), 10.0).tolist()
        [False, True]
    """
    if not threshold >= 1.0:
        raise ValueError(f"Argument `threshold` must be at least 1, but is {threshold}.")
    return threshold * SV < CDV


def _finite(a: np.ndarray) -> np.ndarray:
    """Numbers to be looked at: 1 in place of what is NaN or infinite."""
    return np.where(np.isfinite(a), a, 1.0)


def _norm(g: Float[np.ndarray, "n 2"]) -> Numbers:
    return np.sqrt(g[:, 0] ** 2 + g[:, 1] ** 2)
