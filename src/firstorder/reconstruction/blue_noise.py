"""Blue noise: samples of an image at a given density, evenly spread at every density.

Void and cluster (Ulichney 1993) puts the pixels of a torus in an order in which the first k are
spread out, for every k at once: as long as points are few the tightest cluster is undone and the
largest void filled, with a Gaussian that says how crowded a place is. The tile of ranks is then a
threshold: a pixel is taken where `density > (rank + 1/2) / pixels of the tile`. So one tile serves
all densities, samples follow the density pixel by pixel, and those of a smaller budget are among
those of a larger one.
"""

from __future__ import annotations

import functools

import numpy as np
from jaxtyping import ArrayLike, Bool, Float, Int

from firstorder._argument_checks import (
    check_count,
    check_finite,
    check_integer,
    check_not_negative,
    check_real,
)

SPREAD = 1.5  # of the Gaussian, in pixels, as Ulichney has it
START = 0.1  # share of the pixels that are spread out first


@functools.cache
def _ranks(side: int = 64, seed: int = 0) -> Int[np.ndarray, "s s"]:
    """Tile of the numbers 0 to side^2 - 1, of which the first k are spread out, for every k.

    Args:
        side: of the tile, which repeats [pixels].
        seed: of the random pattern that it starts from.

    Raises:
        ValueError: if `side` is below 4.

    Reference: Ulichney, The void-and-cluster method for dither array generation, 1993.

    Example:
        >>> from firstorder.reconstruction.blue_noise import _ranks
        >>> tile = _ranks(8)
        >>> sorted(tile.ravel().tolist()) == list(range(64))
        True
    """
    check_integer("side", side)
    if side < 4:
        raise ValueError(f"Argument `side` must be at least 4, but is {side}.")
    count = side * side
    first = max(int(START * count), 1)
    kernel = _kernel(side)
    taken = np.zeros(count, bool)
    taken[np.random.default_rng(seed).permutation(count)[:first]] = True
    crowd = sum(_about(kernel, k) for k in np.flatnonzero(taken).tolist())
    assert isinstance(crowd, np.ndarray)
    for _ in range(count):  # until the tightest cluster, taken out, leaves the largest void
        cluster = int(np.argmax(np.where(taken, crowd, -np.inf)))
        taken[cluster] = False
        crowd -= _about(kernel, cluster)
        void = int(np.argmin(np.where(taken, np.inf, crowd)))
        taken[void] = True
        crowd += _about(kernel, void)
        if void == cluster:
            break
    rank = np.empty(count, int)
    left, crowded = taken.copy(), crowd.copy()
    for k in range(first - 1, -1, -1):  # the beginning: clusters go, the last first
        cluster = int(np.argmax(np.where(left, crowded, -np.inf)))
        left[cluster], rank[cluster] = False, k
        crowded -= _about(kernel, cluster)
    for k in range(first, count):  # the rest: voids are filled
        void = int(np.argmin(np.where(taken, np.inf, crowd)))
        taken[void], rank[void] = True, k
        crowd += _about(kernel, void)
    return rank.reshape(side, side)


def _kernel(side: int) -> Float[np.ndarray, "s2 s2"]:
    """A Gaussian on the torus, tiled twice each way so that a slice is centred anywhere."""
    d = np.minimum(np.arange(side), side - np.arange(side))
    one = np.exp(-(d**2) / (2.0 * SPREAD**2))
    return np.tile(np.outer(one, one), (2, 2))


def _about(kernel: np.ndarray, k: int) -> Float[np.ndarray, " n"]:
    side = kernel.shape[0] // 2
    i, j = divmod(k, side)
    return kernel[side - i : 2 * side - i, side - j : 2 * side - j].ravel()


def blue_noise_samples(
    density: ArrayLike,
    count: int,
    side: int = 64,
    seed: int = 0,
    *,
    exactly: bool = False,
) -> Bool[np.ndarray, "w h"]:
    """Mask of about `count` pixels that follow a density, as blue noise.

    A pixel is looked at once at most: what a density asks beyond that goes to the other pixels, in
    proportion. The number found is the number asked but for the tile's rounding.

    Args:
        density: shape (w, h), not negative, of any unit.
        count: of pixels to look at.
        side: of the tile.
        seed: of the tile.
        exactly: whether the rounding is made good too, by the pixels nearest to their thresholds.

    Raises:
        ValueError: for a density that is negative, not finite, or zero everywhere, or for more
            samples than pixels where the density is not zero.

    Reference: D05 §6.2, where a blue-noise tiling does this.

    Example:
        >>> import numpy as np
        >>> from firstorder.reconstruction import blue_noise_samples
        >>> left = np.where(np.arange(64) < 32, 3.0, 1.0)[:, None] + np.zeros(64)
        >>> found = blue_noise_samples(left, 400)
        >>> int(found[:32].sum()), int(found[32:].sum())
        (299, 101)
    """
    check_real("density", np.asarray(density))
    check_integer("side", side)
    check_integer("seed", seed)
    check_not_negative("seed", seed)
    share = _shares(np.asarray(density, float), count)
    tile = _ranks(side, seed)
    repeats = [-(-n // side) for n in share.shape]
    rank = np.tile(tile, repeats)[: share.shape[0], : share.shape[1]]
    margin = share - (rank + 0.5) / side**2
    if not exactly:
        return margin > 0.0
    taken = np.zeros(margin.size, bool)
    taken[np.argsort(-np.where(share > 0.0, margin, -np.inf).ravel(), kind="stable")[:count]] = True
    return taken.reshape(margin.shape)


def _shares(density: np.ndarray, count: int) -> np.ndarray:
    """Probabilities of pixels: the density's proportions, 1 at most, and the sum that is asked."""
    if density.ndim != 2:
        raise ValueError(f"Argument `density` must have shape (w, h), but has {density.shape}.")
    check_finite("density", density)
    check_count("count", count)
    if np.any(density < 0.0):
        raise ValueError(f"Argument `density` must not be negative, but is {np.min(density)}.")
    open_ = density > 0.0
    if np.count_nonzero(open_) < count:
        raise ValueError(
            f"Argument `count` must be at most {np.count_nonzero(open_)}, the pixels of which the "
            f"density is not zero, but is {count}."
        )
    density = density / np.max(density)
    share, full = np.zeros_like(density), np.zeros(density.shape, bool)
    while True:
        rest = open_ & ~full
        left = count - np.count_nonzero(full)
        total = np.sum(density[rest])
        share[full] = 1.0
        if total > 0.0:
            share[rest] = density[rest] * (left / total)
        over = rest & (share > 1.0)
        if not np.any(over):
            return share
        full |= over
