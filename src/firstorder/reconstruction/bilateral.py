"""Cross-bilateral filter: an image from few samples, which depth and normals keep apart.

    I(p) = sum_i w_i I_i / sum_i w_i
    w_i = exp(-|p - p_i|^2 / 2 h^2 - (z - z_i)^2 / 2 (sigma_z z)^2 - |n - n_i|^2 / 2 sigma_n^2)

over the samples nearest to a pixel, with the width h given pixel by pixel: as wide as the samples
are far apart where a bandwidth placed them. Depth and normal are cheap and known at every pixel;
shading is expensive. Beside what is sampled densely the nearest samples may all lie on another
surface: where depth and normal of none are alike, more of them are looked at. Where nothing is,
weights are tiny, not zero: their ratios decide, so that no pixel is left without a value.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.spatial
from jaxtyping import Array, ArrayLike, Float

from firstorder._argument_checks import (
    check_count,
    check_finite,
    check_not_negative,
    check_one,
    check_positive,
    check_real,
)
from firstorder.reconstruction._samples import gaussian_weights, sample_places, sampled
from firstorder.reconstruction.blue_noise import _shares

BLOCK = 65536  # pixels at a time
ALIKE = 2.0  # root of the squares of depth and normal, in spreads, of a sample like a pixel
LARGEST = 1e300  # of it: a sky may be as far away as numbers go
MORE = 8  # times as many neighbours, where none is alike; twice


def bilateral_widths(
    density: Float[np.ndarray | Array, "w h"], count: int, factor: float = 0.7
) -> Float[np.ndarray, "w h"]:
    """Widths of the filter: `factor` times the distance of samples at this density [pixels].

    Args:
        density: that placed the samples, of any unit, not negative.
        count: of samples.
        factor: the blur that is accepted for a smooth picture.

    Raises:
        ValueError: for a density that is negative somewhere or zero everywhere, or a count or
            factor that is not positive.

    Example:
        >>> import numpy as np
        >>> from firstorder.reconstruction import bilateral_widths
        >>> bilateral_widths(np.ones((10, 10)), 25, 1.0)[0, 0].item()  # one sample for four pixels
        2.0
    """
    check_count("count", count)
    check_positive("factor", factor)
    check_real("density", np.asarray(density))
    density = np.asarray(density, float)
    check_not_negative("density", density)
    if not np.any(density):
        raise ValueError("Argument `density` must be positive somewhere, but is zero everywhere.")
    # What full pixels cannot take goes to the others, as where samples are placed.
    share = _shares(density, min(count, int(np.count_nonzero(density))))
    return factor / np.sqrt(np.maximum(share, 1.0 / density.size))


def cross_bilateral(
    p: ArrayLike,
    value: ArrayLike,
    width: ArrayLike,
    depth: ArrayLike,
    normal: ArrayLike,
    *,
    depth_share: float = 0.05,
    normal_spread: float = 0.25,
    neighbours: int = 24,
    shows: tuple[ArrayLike, ArrayLike] | None = None,
) -> Float[np.ndarray, "w h"]:
    """Values at all pixels from samples at some.

    Args:
        p: places of the samples, shape (n, 2), inside the image [pixels].
        value: there, shape (n,).
        width: h at every pixel, shape (w, h), or at all [pixels].
        depth: distance from the eye at every pixel, shape (w, h); any positive number for the sky.
        normal: unit vectors, shape (w, h, 3), zeros for the sky.
        depth_share: sigma_z.
        normal_spread: sigma_n.
        neighbours: samples that count for a pixel; all, if there are fewer. Up to 64 times as many
            where none of them is alike.
        shows: depths (n,) and normals (n, 3) of the samples; those of their pixels, if left out.

    Raises:
        ValueError: for widths, depths or spreads that are not positive, without samples or with
            some outside of the image, or for shapes that do not fit.

    Reference: D05 §6.2, after Tomasi and Manduchi 1998.

    Example:
        >>> import numpy as np
        >>> from firstorder.reconstruction import cross_bilateral
        >>> depth = np.where(np.arange(8) < 4, 1.0, 2.0)[:, None] + np.zeros(8)  # a step
        >>> up = np.zeros((8, 8, 3)) + (0.0, 0.0, 1.0)
        >>> p = np.array([(2.5, 4.5), (5.5, 4.5)])
        >>> found = cross_bilateral(p, np.array([3.0, 7.0]), np.full((8, 8), 4.0), depth, up)
        >>> found[:, 0].round(6).tolist()
        [3.0, 3.0, 3.0, 3.0, 7.0, 7.0, 7.0, 7.0]
    """
    for name, number in (("depth_share", depth_share), ("normal_spread", normal_spread),
                         ("width", width), ("depth", depth)):  # fmt: skip
        check_positive(name, number)
    check_one("depth_share", depth_share)
    check_one("normal_spread", normal_spread)
    check_count("neighbours", neighbours)
    depth, p = np.asarray(depth, float), sample_places(p)
    shape = depth.shape
    if len(shape) != 2 or 0 in shape:
        raise ValueError(f"Argument `depth` must have shape (w, h), but has {shape}.")
    normal, value = sampled("normal", normal, (*shape, 3)), sampled("value", value, p.shape[:1])
    width = sampled("width", width if np.ndim(width) else np.full(shape, width), shape)
    theirs = _pixels(p, depth, normal) if shows is None else _shown(shows, len(p))
    for name, number in (("value", value), ("normal", normal)):
        check_finite(name, number)
    x, y = (np.arange(n) + 0.5 for n in shape)
    at = np.stack(np.meshgrid(x, y, indexing="ij"), -1).reshape(-1, 2)
    own = depth.ravel(), normal.reshape(-1, 3)
    tree, spreads = scipy.spatial.KDTree(p), (depth_share, normal_spread)
    known = _Known(tree, value, theirs, at, own, width.ravel(), spreads)
    return known.image(neighbours).reshape(shape)


def _pixels(p: np.ndarray, depth: np.ndarray, normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Depths and normals of the pixels in which samples lie."""
    outside = np.any((p < 0.0) | (p > depth.shape), 1)
    if np.any(outside):
        raise ValueError(
            f"Argument `p` must lie inside the image, but has a sample at {p[outside][0].tolist()}."
        )
    i, j = np.minimum(p.astype(int), np.array(depth.shape) - 1).T
    return depth[i, j], normal[i, j]


def _shown(shows: tuple[ArrayLike, ArrayLike], count: int) -> tuple[np.ndarray, np.ndarray]:
    """Depths and normals that were given with the samples."""
    theirs = sampled("shows", shows[0], (count,)), sampled("shows", shows[1], (count, 3))
    check_finite("shows", theirs[0])
    check_finite("shows", theirs[1])
    return theirs


class _Known(NamedTuple):
    """Samples and pixels, each with depth and normal.

    Attributes:
        tree: of the samples' places.
        value: of the samples.
        theirs: depths and normals of the samples.
        at: places of the pixels.
        own: depths and normals of the pixels.
        width: h of the pixels.
        spreads: sigma_z and sigma_n.
    """

    tree: scipy.spatial.KDTree
    value: np.ndarray
    theirs: tuple[np.ndarray, np.ndarray]
    at: np.ndarray
    own: tuple[np.ndarray, np.ndarray]
    width: np.ndarray
    spreads: tuple[float, float]

    def image(self, neighbours: int) -> np.ndarray:
        """Values of all pixels, in blocks; from more neighbours where none is alike."""
        count, out = len(self.value), np.empty(len(self.at))
        rest, k, block = np.arange(len(self.at)), neighbours, BLOCK
        for _ in range(3):
            left = []
            for begin in range(0, len(rest), block):
                some = rest[begin : begin + block]
                out[some], alike = self.look(some, min(k, count))
                left.append(some[~alike])
            rest = np.concatenate(left) if left else rest
            if k >= count:
                break
            k, block = k * MORE, block // MORE
        return out

    def look(self, rows: np.ndarray, k: int) -> tuple[np.ndarray, np.ndarray]:
        """Values of some pixels, and whether any of the k nearest samples is alike."""
        (z, n), (z_i, n_i), (share, spread) = self.own, self.theirs, self.spreads
        far, near = self.tree.query(self.at[rows], np.arange(1, k + 1), workers=-1)
        with np.errstate(over="ignore"):
            deep = (z[rows, None] - z_i[near]) / z[rows, None] / share
            turned = np.linalg.norm(n[rows, None] - n_i[near], axis=-1) / spread
            unlike = np.minimum(np.hypot(deep, turned), LARGEST)
            size = np.minimum(np.hypot(far / self.width[rows, None], unlike), LARGEST)
            w = gaussian_weights(size, np.min(size, 1, keepdims=True))
        return np.sum(w * self.value[near], 1) / np.sum(w, 1), np.min(unlike, 1) < ALIKE
