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

from typing import Any

import numpy as np
import scipy.spatial
from jaxtyping import Array, Float, Int

SCHEMES = ("linear", "gradient")


def delaunay_image(
    p: Float[np.ndarray, "n 2"],
    value: Float[np.ndarray, " n"],
    width: int,
    height: int,
    *,
    gradient: Float[np.ndarray, "n 2"] | None = None,
    scheme: str = "linear",
    label: Int[np.ndarray | Array, " n"] | None = None,
    labels: Int[np.ndarray | Array, "w h"] | None = None,
) -> Float[np.ndarray, "w h"]:
    """Values at the centres of all pixels.

    A pixel that shares its label with no corner of its triangle takes the nearest sample of its own
    label (of any, if none has it).

    Args:
        p: places of the samples, at least three and not in one line [pixels].
        value: radiance there.
        width: of the image [pixels].
        height: of the image [pixels].
        gradient: per pixel; needed by the scheme "gradient", used by both where a sample is alone
            and at the border.
        scheme: "linear" or "gradient".
        label: what each sample shows.
        labels: what each pixel shows, first axis across; together with `label`, or not at all.

    Raises:
        ValueError: for an unknown scheme, missing gradients, or labels of one sort only.

    Reference: R07 §9.1 (linear, labels ignored).

    Example:
        >>> import numpy as np
        >>> from firstorder.reconstruction.delaunay import delaunay_image
        >>> p = np.array([(0.0, 0.0), (4.0, 0.0), (0.0, 4.0), (4.0, 4.0)])
        >>> delaunay_image(p, p[:, 0], 4, 1).ravel().tolist()
        [0.5, 1.5, 2.5, 3.5]
    """
    _check(scheme, gradient, label, labels)
    if label is not None:
        label = np.asarray(label)
    ends = (float(width), float(height))
    p, value, slope, label = _mirrored(p, value, gradient, label, ends)
    x, y = np.arange(width) + 0.5, np.arange(height) + 0.5
    at = np.stack(np.meshgrid(x, y, indexing="ij"), -1).reshape(-1, 2)
    corner, weight = _barycentric(p, width, height)
    if label is not None and labels is not None:
        wanted = np.asarray(labels).ravel()
        weight = np.where(label[corner] == wanted[:, None], weight, 0.0)
    else:
        wanted = None
    total = weight.sum(1)
    alone = total <= 1e-9
    corner[alone, 0] = _nearest(p, label, at[alone], None if wanted is None else wanted[alone])
    weight[alone] = (1.0, 0.0, 0.0)
    partial = alone | (total < 1.0 - 1e-9)
    weight /= weight.sum(1, keepdims=True)
    out = value[corner]
    if gradient is not None:
        s = np.where(partial, 1.0, 0.5 if scheme == "gradient" else 0.0)
        out = out + s[:, None] * np.sum(slope[corner] * (at[:, None] - p[corner]), -1)
    return np.sum(weight * out, 1).reshape(width, height)


def _check(scheme, gradient, label, labels) -> None:
    if scheme not in SCHEMES:
        raise ValueError(f"Argument `scheme` must be one of {SCHEMES}, but is {scheme!r}.")
    if scheme == "gradient" and gradient is None:
        raise ValueError("Argument `gradient` is needed by the scheme 'gradient', but is None.")
    if (label is None) != (labels is None):
        raise ValueError("Arguments `label` and `labels` must come together, but one is None.")


def _mirrored(p, value, gradient, label, ends):
    """The samples with those near the border mirrored in it, across each side in turn."""
    border = np.concatenate([_side(ends, k, end) for k in (0, 1) for end in (0.0, ends[k])])
    tree = scipy.spatial.KDTree(p)
    reach = 2.0 * np.max(tree.query(border)[0])
    if gradient is None:
        near = np.flatnonzero(np.any((p <= reach) | (p >= ends - np.float64(reach)), 1))
        gradient = np.zeros_like(p)
        gradient[near] = _planes(tree, value, label, near)
    for axis in (0, 1):
        for end in (0.0, ends[axis]):
            near = np.flatnonzero((abs(p[:, axis] - end) <= reach) & (p[:, axis] != end))
            image = p[near]
            image[:, axis] = 2.0 * end - image[:, axis]
            there = value[near] + np.sum(gradient[near] * (image - p[near]), -1)
            p, value = np.concatenate([p, image]), np.concatenate([value, there])
            gradient = np.concatenate([gradient, gradient[near]])
            label = None if label is None else np.concatenate([label, label[near]])
    return p, value, gradient, label


NEIGHBOURS = 8


def _planes(tree: scipy.spatial.KDTree, value, label, rows) -> Float[np.ndarray, "k 2"]:
    """Gradients of planes through samples, by least squares over their nearest neighbours."""
    p = tree.data
    _, others = tree.query(p[rows], min(NEIGHBOURS + 1, len(p)))
    d, change = p[others] - p[rows, None], value[others] - value[rows, None]
    same = 1.0 if label is None else (label[others] == label[rows, None]).astype(float)
    w = same / np.maximum(np.sum(d * d, -1), 1e-12)
    xx, xy, yy = (np.sum(w * d[..., i] * d[..., j], 1) for i, j in ((0, 0), (0, 1), (1, 1)))
    x, y = (np.sum(w * d[..., i] * change, 1) for i in (0, 1))
    det = xx * yy - xy * xy
    sound = det > 1e-6 * (xx + yy) ** 2  # neighbours that are not in line
    det = np.where(sound, det, np.inf)
    return np.stack([(yy * x - xy * y) / det, (xx * y - xy * x) / det], -1)


def _side(ends, axis: int, end: float) -> np.ndarray:
    """Places along one side of the image, a pixel apart."""
    along = np.arange(ends[1 - axis] + 1.0)
    return np.stack([np.full_like(along, end), along][:: 1 if axis == 0 else -1], -1)


def _barycentric(p: np.ndarray, width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
    """Corners of the triangle around each pixel's centre and weights; all 0 outside of the hull.

    Each triangle is drawn over the pixels of its bounding box. That needs no search, and costs a
    tenth of the affine maps that SciPy inverts one by one for its own.
    """
    triangle = scipy.spatial.Delaunay(p).simplices
    A, B, C = p[triangle].transpose(1, 0, 2)
    flat = _area(A, B, C) == 0.0  # along the hull, where samples lie in line
    triangle, A, B, C = triangle[~flat], A[~flat], B[~flat], C[~flat]
    low = np.ceil(np.minimum(np.minimum(A, B), C) - 0.5).astype(int).clip(0)
    high = np.floor(np.maximum(np.maximum(A, B), C) - 0.5).astype(int)
    side = np.maximum(np.minimum(high, (width - 1, height - 1)) - low + 1, 0)
    count = side[:, 0] * side[:, 1]
    which = np.repeat(np.arange(len(triangle)), count)
    number = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
    i, j = low[which].T + np.divmod(number, side[which, 1])
    at = np.stack([i, j], -1) + 0.5
    area = _area(A, B, C)[which]
    u = _area(at, B[which], C[which]) / area
    v = _area(A[which], at, C[which]) / area
    weight = np.stack([u, v, 1.0 - u - v], -1)
    inside = np.min(weight, 1) >= -1e-9
    pixel = (i * height + j)[inside]
    corners, weights = np.zeros((width * height, 3), int), np.zeros((width * height, 3))
    corners[pixel], weights[pixel] = triangle[which[inside]], np.maximum(weight[inside], 0.0)
    return corners, weights


def _area(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Twice the signed area of triangles."""
    u, v = b - a, c - a
    return u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]


def _nearest(p, label, at, wanted) -> Any:
    """The nearest sample, of the label that is wanted where one is."""
    found = np.asarray(scipy.spatial.KDTree(p).query(at)[1] if len(at) else [], int)
    if wanted is not None:
        for one in np.unique(wanted):
            own = np.flatnonzero(label == one)
            if own.size:
                here = wanted == one
                found[here] = own[scipy.spatial.KDTree(p[own]).query(at[here])[1]]
    return found
