"""House style: three colour maps that keep their order in grey, a line cycle, and labels."""

from __future__ import annotations

import contextlib
import itertools
from collections.abc import Iterator

import matplotlib
import numpy as np
from cycler import cycler
from matplotlib.axis import Axis
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

# Lightness rises evenly from the negative end to the positive one, so the sign survives in grey:
# dark is negative, mid-grey zero, light positive.
SIGNED = LinearSegmentedColormap.from_list(
    "firstorder.signed",
    [
        (0.0, "#08204d"),
        (0.25, "#2a5c9c"),
        (0.5, "#8d8f94"),
        (0.75, "#e2b06a"),
        (1.0, "#fff6d8"),
    ],
)
RADIANCE = "magma"
MAGNITUDE = "viridis"

# Distinct in lightness as well as in hue, and each with a dash of its own.
COLOURS = ("#1b1b1b", "#c2410c", "#2563eb", "#e0a526", "#0f766e", "#a78bca")
_DASHES = ("-", "--", "-.", "-", (0, (1, 1.2)), "--")

_STYLE = {
    "figure.dpi": 100,
    "savefig.dpi": 160,
    "font.size": 9,
    "axes.titlesize": 9,
    "axes.labelsize": 9,
    "axes.linewidth": 0.7,
    "axes.prop_cycle": cycler(color=COLOURS, linestyle=_DASHES),
    "axes.formatter.useoffset": False,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "lines.linewidth": 1.4,
    "legend.fontsize": 8,
    "legend.frameon": False,
    "image.origin": "lower",
    "image.interpolation": "nearest",
    "mathtext.fontset": "dejavusans",
    "svg.hashsalt": "firstorder",  # the same picture is the same file
}


@contextlib.contextmanager
def house_style() -> Iterator[None]:
    """Draws and saves in the house style inside the context, and in the user's own outside.

    Example:
        >>> from firstorder.plotting import house_style, panels
        >>> with house_style():
        ...     figure, axes = panels(1, 2)
        >>> axes.shape
        (1, 2)
    """
    with matplotlib.rc_context(_STYLE):
        yield


def panels(
    rows: int = 1, columns: int = 1, width: float = 2.7, height: float = 2.4, **options
) -> tuple[Figure, np.ndarray]:
    """Makes a figure of `rows` x `columns` panels, without pyplot.

    Args:
        rows: number of rows.
        columns: number of columns.
        width: of one panel, in inches.
        height: of one panel, in inches.
        options: passed to `Figure.subplots` (`sharex`, `width_ratios`, `gridspec_kw`, ...).

    Returns:
        The figure and its axes, always as an array of shape (rows, columns).

    Example:
        >>> from firstorder.plotting import panels
        >>> figure, axes = panels(1, 2)
        >>> axes.shape
        (1, 2)
    """
    figure = Figure(figsize=(width * columns, height * rows), layout="constrained")
    return figure, figure.subplots(rows, columns, squeeze=False, **options)


_SYMBOLS = {
    "theta": r"\theta",
    "phi": r"\phi",
    "omega": r"\omega",
    "kappa": r"\kappa",
    "rho": r"\rho",
}
_UNITS = {
    "x": "m",
    "y": "m",
    "z": "m",
    "d": "m",
    "t": "s",
    "theta": "rad",
    "phi": "rad",
    "kappa": "rad/m",
}


def label(name: str, unit: bool = True) -> str:
    r"""Writes a coordinate's name as it stands on an axis, with its unit.

    Example:
        >>> from firstorder.plotting import label
        >>> print(label("v"), label("x"), label("Omega_kappa"))
        $v$ $x$ (m) $\Omega_{\kappa}$ (cycles/(rad/m))
    """
    if name.startswith("Omega_"):
        of = name.removeprefix("Omega_")
        symbol, per = rf"\Omega_{{{_SYMBOLS.get(of, of)}}}", _UNITS.get(of, "")
        per = f"({per})" if "/" in per else per
        return f"${symbol}$" + (f" (cycles{'/' + per if per else ''})" if unit else "")
    symbol, of = _SYMBOLS.get(name, name), _UNITS.get(name)
    return f"${symbol}$" + (f" ({of})" if unit and of else "")


def share_labels(axes: np.ndarray) -> None:
    """Labels an axis once where the panel to the left, or the one below, has the same.

    Args:
        axes: panels of shape (rows, columns), as `panels` returns them.

    Example:
        >>> from firstorder.plotting import panels, share_labels
        >>> figure, axes = panels(1, 2)
        >>> for ax in axes[0]:
        ...     _ = ax.set_ylabel("E (W/m)")
        >>> share_labels(axes)
        >>> [ax.yaxis.label.get_visible() for ax in axes[0]]
        [True, False]
    """
    for column in axes.T:
        for upper, lower in itertools.pairwise(column):
            if _same(upper.xaxis, lower.xaxis):
                upper.xaxis.label.set_visible(False)
                upper.tick_params(labelbottom=False)
    for row in axes:
        for left, right in itertools.pairwise(row):
            if _same(left.yaxis, right.yaxis):
                right.yaxis.label.set_visible(False)
                right.tick_params(labelleft=False)


def _same(one: Axis, other: Axis) -> bool:
    words = one.get_label_text() == other.get_label_text()
    return words and np.allclose(one.get_view_interval(), other.get_view_interval())
