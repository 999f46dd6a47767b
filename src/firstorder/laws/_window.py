"""Windows for spectra of products: one that holds the light, and a warning if one does not."""

from __future__ import annotations

import sys
import warnings

import jax
import jax.numpy as jnp
import numpy as np

from firstorder._argument_checks import is_concrete
from firstorder.fields._level_series import level_range
from firstorder.fields.extent import Extent
from firstorder.fields.field import Field
from firstorder.fields.spectrum import Grid, Spectrum, _MovedGrid
from firstorder.laws._stairs import steps_of

WAVES = 256  # along each coordinate, where nobody says how many
MOST = 20_000  # terms of a series that is taken without being asked for
SEEN = 4.0  # deviations of a bell that a window must hold: it is 3e-4 of its height there


def holding(extent: Extent, waves: int = WAVES) -> Grid:
    """The box around a light, as a window with so many waves along each coordinate.

    Example:
        >>> from firstorder.fields import gaussian
        >>> from firstorder.laws._window import holding
        >>> window = holding(gaussian((0.0, 1.0), (0.5, 0.2)).spectrum().extent())
        >>> round(float(window.extent[0]), 12)  # 8.5 deviations on both sides
        8.5
    """
    n = extent.center.shape[1]
    ends = [extent.along(axis) for axis in np.eye(n)]
    widths = [jnp.where(high > low, high - low, 1.0) for low, high in ends]
    steps = tuple(w / waves for w in widths)
    center = tuple(0.5 * (low + high) for low, high in ends)
    if is_concrete((steps, center)):
        return Grid((waves,) * n, tuple(map(float, steps)), tuple(map(float, center)))
    return _MovedGrid((waves,) * n, steps, center)


def warn_if_cut(factor: Field, window: Grid, F: Spectrum, name: str) -> None:
    """Warn, on the host, if the light reaches beyond a window along what the factor depends on."""
    extent = F.extent()
    if extent is None or not is_concrete((extent, factor, window)):
        return
    steps = steps_of(factor)
    if steps is not None:  # the period is the range of the level, whichever way it runs
        level, low, high = steps[0], *level_range(steps[0], window)
        first, last = (end + level.offset for end in extent.along(level.normal, SEEN))
        _say(name, "the edge's level", low, high, first, last)
        return
    for i, axis in enumerate(np.eye(len(window.size))):
        first, last = extent.along(axis, SEEN)
        low, high = (window.center[i] + s * window.extent[i] for s in (-0.5, 0.5))
        if _out(low, high, first, last) and _depends(factor, window, i):
            _say(name, F.frame.coordinates[i], low, high, first, last)


def _out(low, high, first, last) -> bool:
    """Whether an interval does not hold another, up to rounding."""
    ends = np.array([float(x) for x in (low, high, first, last)])
    epsilon = 1e-6 * (ends[3] - ends[2])
    return bool(
        np.all(np.isfinite(ends)) and (ends[2] < ends[0] - epsilon or ends[3] > ends[1] + epsilon)
    )


def _depends(factor: Field, window: Grid, i: int) -> bool:
    """Whether the factor's series repeats with the window along coordinate i.

    A factor that ignores the coordinate has no frequencies along it; a wave or a grating has its
    own, whatever the window.
    """
    wider = Grid(window.size, tuple(2.0 * h for h in window.step), window.center)
    a, b = (jax.jit(lambda w=w: factor.series(w).frequencies[:, i])() for w in (window, wider))
    return bool(np.any(a != 0)) and not np.array_equal(a, b)


def _say(name: str, along: str, low, high, first, last) -> None:
    if _out(low, high, first, last):
        warnings.warn(
            f"Argument `window` of {name} does not hold the light: along {along} it is from "
            f"{float(low):.3g} to {float(high):.3g}, the light from {float(first):.3g} to "
            f"{float(last):.3g}; beyond the window the factor repeats, and the spectrum is wrong.",
            stacklevel=_outside(sys._getframe()),
        )


def _outside(frame) -> int:
    """Number of frames up the stack to the user's code, past the library and its wrappers."""
    inner = {"firstorder", "jaxtyping", "beartype", "equinox"}
    level = 1
    while frame.f_back is not None and _package(frame) in inner:
        frame, level = frame.f_back, level + 1
    return level


def _package(frame) -> str:
    """The package of a frame; wrappers that are generated, or hide themselves, are beartype's."""
    wraps = frame.f_code.co_filename.startswith("<@") or "__tracebackhide__" in frame.f_locals
    return "beartype" if wraps else frame.f_globals.get("__name__", "").split(".")[0]
