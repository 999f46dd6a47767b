"""Images from triangles whose corners are samples: drawn over pixels, and blended."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import scipy.spatial
from jaxtyping import ArrayLike, Float, Int

from firstorder._argument_checks import check_shape
from firstorder.reconstruction._samples import sample_places, sampled

SCHEMES = ("linear", "gradient")
NEIGHBOURS = 8


class Vertices(NamedTuple):
    """Samples that are corners of triangles.

    Attributes:
        p: places [pixels].
        value: radiance.
        gradient: per pixel, or None.
        label: what each shows, or None.
    """

    p: Float[np.ndarray, "n 2"]
    value: Float[np.ndarray, " n"]
    gradient: Any
    label: Any


def vertices(p: ArrayLike, value: ArrayLike, gradient: ArrayLike | None, label: Any) -> Vertices:
    """Samples as corners.

    Raises:
        ValueError: in one sentence, where they do not fit one another.
    """
    p = sample_places(p)
    value = sampled("value", value, p.shape[:1])
    gradient = None if gradient is None else sampled("gradient", gradient, p.shape)
    if label is not None:
        label = np.asarray(label)
        check_shape("label", label, p.shape[:1])
    return Vertices(p, value, gradient, label)


def check_scheme(scheme: str, gradient, label, labels) -> None:
    """Refuse an unknown scheme, and what it cannot do without.

    Raises:
        ValueError: in one sentence.
    """
    if scheme not in SCHEMES:
        raise ValueError(f"Argument `scheme` must be one of {SCHEMES}, but is {scheme!r}.")
    if scheme == "gradient" and gradient is None:
        raise ValueError("Argument `gradient` is needed by the scheme 'gradient', but is None.")
    if (label is None) != (labels is None):
        raise ValueError("Arguments `label` and `labels` must come together, but one is None.")


# --- beyond the border ---------------------------------------------------------------------------


def mirror_across(at: Vertices, rows, axis: int, end: float) -> Vertices:
    """The samples, and some of them once more, mirrored in a side of the image.

    Their images take the value of the tangent plane there, which needs gradients.
    """
    image = at.p[rows]
    image[:, axis] = 2.0 * end - image[:, axis]
    there = at.value[rows] + np.sum(at.gradient[rows] * (image - at.p[rows]), -1)
    label = None if at.label is None else np.concatenate([at.label, at.label[rows]])
    return Vertices(
        np.concatenate([at.p, image]),
        np.concatenate([at.value, there]),
        np.concatenate([at.gradient, at.gradient[rows]]),
        label,
    )


def planes(at: Vertices, rows) -> Float[np.ndarray, "k 2"]:
    """Gradients of planes through samples, by least squares over their nearest neighbours."""
    p, value, label = at.p, at.value, at.label
    _, others = scipy.spatial.KDTree(p).query(p[rows], min(NEIGHBOURS + 1, len(p)))
    d, change = p[others] - p[rows, None], value[others] - value[rows, None]
    w = 1.0 / np.maximum(np.sum(d * d, -1), 1e-12)
    if label is not None:
        same = label[others] == label[rows, None]
        w, change = np.where(same, w, 0.0), np.where(same, change, 0.0)  # others may be NaN
    xx, xy, yy = (np.sum(w * d[..., i] * d[..., j], 1) for i, j in ((0, 0), (0, 1), (1, 1)))
    x, y = (np.sum(w * d[..., i] * change, 1) for i in (0, 1))
    det = xx * yy - xy * xy
    sound = det > 1e-6 * (xx + yy) ** 2  # neighbours that are not in line
    det = np.where(sound, det, np.inf)
    return np.stack([(yy * x - xy * y) / det, (xx * y - xy * x) / det], -1)


# --- the image -----------------------------------------------------------------------------------


def blended(
    at: Vertices,
    triangle: Int[np.ndarray, "t 3"],
    width: int,
    height: int,
    labels,
    scheme: str,
    sloped: bool,
) -> Float[np.ndarray, "w h"]:
    """Values at the centres of all pixels, from triangles that cover the image.

    Args:
        at: the samples.
        triangle: numbers of their corners.
        width: of the image [pixels].
        height: of the image [pixels].
        labels: what each pixel shows, or None: corners that show something else drop out.
        scheme: "linear" or "gradient".
        sloped: whether the samples' gradients are known, and used where corners drop out.
    """
    wanted = None if labels is None else np.asarray(labels)
    if wanted is not None:
        check_shape("labels", wanted, (width, height))
        wanted = wanted.ravel()
    corner, weight = _rasterised(at.p, triangle, width, height)
    if wanted is not None:
        weight = np.where(at.label[corner] == wanted[:, None], weight, 0.0)
    total = weight.sum(1)
    alone = np.flatnonzero(total <= 1e-9)
    pixel = np.stack(np.divmod(np.arange(width * height), height), -1) + 0.5
    if len(alone):
        own = None if wanted is None else wanted[alone]
        corner[alone, 0] = _nearest(at.p, at.label, pixel[alone], own)
        weight[alone] = (1.0, 0.0, 0.0)
    counts = weight > 0.0
    out = np.where(counts, at.value[corner], 0.0)  # what drops out may be NaN
    if sloped:
        partial = total < 1.0 - 1e-9
        s = np.where(partial, 1.0, 0.5 if scheme == "gradient" else 0.0)
        some = np.flatnonzero(s)
        way = pixel[some, None] - at.p[corner[some]]
        slope = np.where(counts[some, :, None], at.gradient[corner[some]], 0.0)
        out[some] += s[some, None] * np.sum(slope * way, -1)
    return (np.sum(weight * out, 1) / weight.sum(1)).reshape(width, height)


def _rasterised(
    p: np.ndarray, triangle: np.ndarray, width: int, height: int
) -> tuple[np.ndarray, np.ndarray]:
    """Corners of the triangle around each pixel's centre and weights; all 0 where there is none.

    Each triangle is drawn over the pixels of its bounding box, which needs no search. Where a
    sample stands right at a pixel's centre, no triangle is asked.
    """
    A, B, C = p[triangle].transpose(1, 0, 2)
    whole = _area(A, B, C)
    low = np.ceil(np.minimum(np.minimum(A, B), C) - 0.5).astype(int).clip(0)
    high = np.floor(np.maximum(np.maximum(A, B), C) - 0.5).astype(int)
    side = np.maximum(np.minimum(high, (width - 1, height - 1)) - low + 1, 0)
    side[whole == 0.0] = 0  # along the hull, where samples lie in line
    count = side[:, 0] * side[:, 1]
    which = np.repeat(np.arange(len(triangle)), count)
    number = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
    across, up = np.divmod(number, side[which, 1])
    i, j = low[which, 0] + across, low[which, 1] + up
    edges = _edge_functions(A, B, C, whole)[which]
    x, y = i + 0.5, j + 0.5
    u = edges[:, 0] + edges[:, 1] * x + edges[:, 2] * y
    v = edges[:, 3] + edges[:, 4] * x + edges[:, 5] * y
    w = 1.0 - u - v
    inside = np.flatnonzero(np.minimum(np.minimum(u, v), w) >= -1e-9)
    pixel = i[inside] * height + j[inside]
    corners, weights = np.zeros((width * height, 3), int), np.zeros((width * height, 3))
    corners[pixel] = triangle[which[inside]]
    weights[pixel] = np.maximum(np.stack([u[inside], v[inside], w[inside]], -1), 0.0)
    on = np.flatnonzero(
        np.all(p - 0.5 == np.floor(p), 1) & np.all((p > 0.0) & (p < (width, height)), 1)
    )
    at = p[on].astype(int)
    pixel = at[:, 0] * height + at[:, 1]
    corners[pixel], weights[pixel] = on[:, None], (1.0, 0.0, 0.0)
    return corners, weights


def _edge_functions(A, B, C, whole) -> Float[np.ndarray, "t 6"]:
    """The first two barycentric coordinates of triangles as functions 1, x, y of the place."""
    whole = np.where(whole == 0.0, 1.0, whole)

    def opposite(P, Q):
        dx, dy = (Q - P).T
        return [P[:, 1] * dx - P[:, 0] * dy, dy, -dx]

    return np.stack([*opposite(C, B), *opposite(A, C)], -1) / whole[:, None]


def _area(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Twice the signed area of triangles."""
    u, v = b - a, c - a
    return u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]


def _nearest(p, label, at, wanted) -> Any:
    """The nearest sample, of the label that is wanted where one is."""
    found = np.asarray(scipy.spatial.KDTree(p).query(at)[1], int)
    if wanted is not None:
        for one in np.unique(wanted):
            own = np.flatnonzero(label == one)
            if own.size:
                here = wanted == one
                found[here] = own[scipy.spatial.KDTree(p[own]).query(at[here])[1]]
    return found
