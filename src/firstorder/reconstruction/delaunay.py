"""An image from scattered samples: a Delaunay triangulation, linear or with the samples' gradients.

    I(p) = sum_i b_i(p) (I_i + s grad I_i . (p - p_i))        b: barycentric coordinates

With s = 0 that is linear interpolation. With s = 1/2 it is exact for quadratic images: the linear
part errs by `1/2 sum b_i d_i^T H d_i` with `d_i = p_i - p`, the gradients' by just as much with the
other sign. Where the triangle's corners do not all show what the pixel shows, the others drop out,
and s = 1 there: nothing is left to interpolate, the tangent plane extrapolates.

Samples seldom lie on the image's border, and long thin triangles along their hull would join what
is far apart. So samples near the border are mirrored in it first. Their images take the value of
the tangent plane there; without gradients, of a plane through the nearest samples of their label.
"""

from __future__ import annotations

import numpy as np
import scipy.spatial
from jaxtyping import Array, ArrayLike, Float, Int

from firstorder._argument_checks import check_count
from firstorder.reconstruction._triangles import (
    Vertices,
    blended,
    check_scheme,
    mirror_across,
    planes,
    vertices,
)


def delaunay_image(
    p: ArrayLike,
    value: ArrayLike,
    width: int,
    height: int,
    *,
    gradient: ArrayLike | None = None,
    scheme: str = "linear",
    label: Int[np.ndarray | Array, " n"] | None = None,
    labels: Int[np.ndarray | Array, "w h"] | None = None,
) -> Float[np.ndarray, "w h"]:
    """Values at the centres of all pixels.

    A pixel that shares its label with no corner of its triangle takes the nearest sample of its own
    label (of any, if none has it).

    Args:
        p: places of the samples, shape (n, 2) [pixels].
        value: radiance there, shape (n,).
        width: of the image [pixels].
        height: of the image [pixels].
        gradient: shape (n, 2), per pixel; needed by the scheme "gradient", used by both where a
            sample is alone and at the border.
        scheme: "linear" or "gradient".
        label: what each sample shows.
        labels: what each pixel shows, first axis across; together with `label`, or not at all.

    Raises:
        ValueError: for an unknown scheme, missing gradients, labels of one sort only, no samples,
            or shapes that do not fit.

    Reference: R07 §9.1 (linear, labels ignored).

    Example:
        >>> import numpy as np
        >>> from firstorder.reconstruction import delaunay_image
        >>> p = np.array([(0.0, 0.0), (4.0, 0.0), (0.0, 4.0), (4.0, 4.0)])
        >>> delaunay_image(p, p[:, 0], 4, 1).ravel().tolist()
        [0.5, 1.5, 2.5, 3.5]
    """
    check_scheme(scheme, gradient, label, labels)
    check_count("width", width)
    check_count("height", height)
    at = _mirrored(vertices(p, value, gradient, label), (float(width), float(height)))
    triangle = scipy.spatial.Delaunay(at.p).simplices
    return blended(at, triangle, width, height, labels, scheme, gradient is not None)


def _mirrored(at: Vertices, ends) -> Vertices:
    """The samples with those near the border mirrored in it, across each side in turn."""
    border = np.concatenate([_side(ends, k, end) for k in (0, 1) for end in (0.0, ends[k])])
    reach = 2.0 * np.max(scipy.spatial.KDTree(at.p).query(border)[0])
    if at.gradient is None:
        near = np.flatnonzero(np.any((at.p <= reach) | (at.p >= ends - np.float64(reach)), 1))
        at = at._replace(gradient=np.zeros_like(at.p))
        at.gradient[near] = planes(at, near)
    for axis in (0, 1):
        for end in (0.0, ends[axis]):
            inward = at.p[:, axis] - end if end == 0.0 else end - at.p[:, axis]
            # A sample beyond the side would have its image, a guess, inside.
            near = np.flatnonzero((inward > 0.0) & (inward <= reach))
            at = mirror_across(at, near, axis, end)
    return at


def _side(ends, axis: int, end: float) -> np.ndarray:
    """Places along one side of the image, a pixel apart."""
    along = np.arange(ends[1 - axis] + 1.0)
    return np.stack([np.full_like(along, end), along][:: 1 if axis == 0 else -1], -1)
