"""Shared by stills of caustics: tubes of light between neighbouring rays, spread over pixels."""

from __future__ import annotations

import numpy as np

AT_ONCE = 100_000  # crossings of a row and a ray that are worked on together


def spread(image, p, flux, extent) -> None:
    """Add to an image, rows from below, the tubes between rays p of shape (2, n, 2).

    Two neighbours bound a tube whose flux is known. In each row of pixels that it crosses, or in
    each column if it is flat, the flux lies evenly over the tube's width there.
    """
    left, right, low, _ = extent
    scale = image.shape[1] / (right - left)
    a, b = (p - (left, low)) * scale - 0.5
    steep = np.abs((b - a)[:-1, 1]) > np.abs((b - a)[:-1, 0])
    for chosen, axis, target in ((steep, 1, image), (~steep, 0, image.T)):
        pairs = np.flatnonzero(chosen & np.isfinite(flux) & (flux > 0.0))
        if not pairs.size:
            continue
        lines = np.arange(target.shape[0])
        for some in np.array_split(lines, 1 + lines.size * len(a) // AT_ONCE):
            target[some] += _crossed(a, b, pairs, axis, some, flux * scale, target.shape[1])


def _crossed(a, b, pairs, axis: int, lines, flux, count: int) -> np.ndarray:
    """Light on lines of pixels, shape (lines, count), by the tubes between rays and the next."""
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (lines[:, None] - a[:, axis]) / (b - a)[:, axis]
    x = a[:, 1 - axis] + np.where((t >= 0.0) & (t <= 1.0), t, np.nan) * (b - a)[:, 1 - axis]
    one, other = x[:, pairs], x[:, pairs + 1]
    line, tube = np.nonzero(np.isfinite(one) & np.isfinite(other))
    one, other, there = one[line, tube], other[line, tube], pairs[tube]
    way = (b - a)[there]
    slant = np.abs(way[:, axis]) / np.hypot(*way.T)
    start = np.minimum(one, other)
    # A width below a hundredth of a pixel is taken for that.
    end = np.maximum(np.maximum(one, other), start + 0.01)
    return _boxes(line, start, end, flux[there] / (end - start) / slant, lines.size, count)


def _boxes(line, start, end, density, lines: int, count: int) -> np.ndarray:
    """Means over pixels, whose middles are whole numbers, of a sum of boxes on each line."""
    wide = count + 2
    total = np.zeros((lines, wide))
    for x, d in ((start, density), (end, -density)):
        x = np.clip(x + 0.5, 0.0, count)
        j = np.floor(x).astype(int)
        at, size = line * wide + j, lines * wide
        total += np.bincount(at, d * (j + 1.0 - x), size).reshape(lines, wide)
        later = np.bincount(at + 1, d, size).reshape(lines, wide)
        total += np.cumsum(later, axis=1)
    return total[:, :count]
