"""An image from few samples, kept apart where depth or normal says so: a cross-bilateral filter.

    I(p) = sum_i w_i I_i / sum_i w_i
    w_i = exp(-|p - p_i|^2 / 2 h^2 - (z - z_i)^2 / 2 (sigma_z z)^2 - |n - n_i|^2 / 2 sigma_n^2)

over the samples nearest to a pixel, with the width h given pixel by pixel: as wide as the samples
are far apart where a bandwidth placed them. Depth and normal are cheap and known at every pixel;
shading is dear. Where nothing near is alike the weights are tiny, not zero: their ratios decide,
so that no pixel is left without a value.
"""

from __future__ import annotations

import numpy as np
import scipy.spatial
from jaxtyping import Array, Float

from firstorder.errors import check_finite, check_positive

BLOCK = 65536  # pixels at a time


def widths(
    density: Float[np.ndarray | Array, "w h"], count: int, factor: float = 0.7
) -> Float[np.ndarray, "w h"]:
    """Widths of the filter: `factor` times the distance of samples at this density [pixels].

    Args:
        density: that placed the samples, of any unit, not negative.
        count: of samples.
        factor: the blur that is accepted for a smooth picture.

    Example:
        >>> import numpy as np
        >>> from firstorder.methods.bilateral import widths
        >>> widths(np.ones((10, 10)), 25, 1.0)[0, 0].item()  # one sample for four pixels
        2.0
    """
    check_positive("count", count)
    check_positive("factor", factor)
    density = np.asarray(density, float)
    share = np.clip(density * (count / np.sum(density)), 1.0 / density.size, 1.0)
    return factor / np.sqrt(share)


def cross_bilateral(
    p: Float[np.ndarray, "n 2"],
    value: Float[np.ndarray, " n"],
    width: Float[np.ndarray, "w h"],
    depth: Float[np.ndarray, "w h"],
    normal: Float[np.ndarray, "w h 3"],
    *,
    depth_share: float = 0.05,
    normal_spread: float = 0.25,
    neighbours: int = 24,
) -> Float[np.ndarray, "w h"]:
    """Values at all pixels from samples at some.

    Args:
        p: places of the samples, inside the image [pixels].
        value: there.
        width: h at every pixel [pixels].
        depth: distance from the eye at every pixel; any positive number for the sky.
        normal: unit vectors, zeros for the sky.
        depth_share: sigma_z.
        normal_spread: sigma_n.
        neighbours: samples that count for a pixel; all, if there are fewer.

    Raises:
        ValueError: for widths, depths or spreads that are not positive.

    Reference: D05 §6.2, after Tomasi and Manduchi 1998.

    Example:
        >>> import numpy as np
        >>> from firstorder.methods.bilateral import cross_bilateral
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
    check_finite("value", value)
    shape = depth.shape
    k = min(neighbours, len(p))
    i, j = np.minimum(p.astype(int), np.array(shape) - 1).T
    z_i, n_i = depth[i, j], normal[i, j]
    x, y = (np.arange(n) + 0.5 for n in shape)
    at = np.stack(np.meshgrid(x, y, indexing="ij"), -1).reshape(-1, 2)
    h, z, n = width.ravel(), depth.ravel(), normal.reshape(-1, 3)
    tree, out = scipy.spatial.KDTree(p), np.empty(len(at))
    for begin in range(0, len(at), BLOCK):
        some = slice(begin, begin + BLOCK)
        far, near = tree.query(at[some], np.arange(1, k + 1), workers=-1)
        exponent = (far / h[some, None]) ** 2
        exponent += ((z[some, None] - z_i[near]) / (depth_share * z[some, None])) ** 2
        exponent += np.sum((n[some, None] - n_i[near]) ** 2, -1) / normal_spread**2
        w = np.exp(-0.5 * (exponent - np.min(exponent, 1, keepdims=True)))
        out[some] = np.sum(w * value[near], 1) / np.sum(w, 1)
    return out.reshape(shape)


__all__ = ["cross_bilateral", "widths"]
