"""Overlays of a picture: its scale and a covariance."""

from __future__ import annotations

import numpy as np
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.patches import Ellipse
from matplotlib.text import Text

from firstorder._argument_checks import check_positive, check_shape

_HALO = [patheffects.withStroke(linewidth=2.4, foreground="black")]


def print_scale(ax: Axes, words: str) -> Text:
    """Prints the scale of a picture at its upper right, outside the data.

    Args:
        ax: with the picture.
        words: what is printed.

    Example:
        >>> from firstorder.plotting import panels, print_scale
        >>> figure, axes = panels()
        >>> print_scale(axes[0, 0], "0 to 2").get_text()
        '0 to 2'
    """
    return ax.set_title(words, loc="right", fontsize=7, color="0.35")


def covariance_ellipse(ax: Axes, matrix, *, sigmas: float = 1.0, center=(0.0, 0.0), color="white"):
    """Outlines a covariance: the ellipse `u^T S^-1 u = sigmas^2`.

    Drawn over a spectrum it shows the second moments of the power; over a light field, with
    the covariance of the light, its width.

    Args:
        ax: where to draw.
        matrix: symmetric 2 x 2 matrix, in squared units of the axes; it may be singular.
        sigmas: size.
        center: middle of the ellipse.
        color: of the line; a dark halo keeps it visible on light ground.

    Returns:
        The ellipse.

    Example:
        >>> from firstorder.plotting import covariance_ellipse, panels
        >>> figure, axes = panels()
        >>> ellipse = covariance_ellipse(axes[0, 0], [[4.0, 0.0], [0.0, 1.0]])
        >>> ellipse.width, ellipse.height, ellipse.angle % 180
        (2.0, 4.0, 90.0)
    """
    ellipse = Ellipse(center, 1.0, 1.0)
    ellipse.set(fill=False, edgecolor=color, linewidth=1.3, path_effects=_HALO)
    set_covariance(ellipse, matrix, sigmas=sigmas)
    ax.add_patch(ellipse)
    return ellipse


def set_covariance(ellipse: Ellipse, matrix, *, sigmas: float = 1.0) -> None:
    """Gives an ellipse that `covariance_ellipse` drew another covariance.

    Args:
        ellipse: that is changed.
        matrix: symmetric, shape (2, 2).
        sigmas: how many standard deviations it shows.

    Raises:
        ValueError: if the matrix has another shape, or `sigmas` not positive.

    Example:
        >>> from firstorder.plotting import covariance_ellipse, panels, set_covariance
        >>> figure, axes = panels()
        >>> ellipse = covariance_ellipse(axes[0, 0], [[4.0, 0.0], [0.0, 1.0]])
        >>> set_covariance(ellipse, [[16.0, 0.0], [0.0, 1.0]])
        >>> max(ellipse.width, ellipse.height)
        8.0
    """
    matrix = np.asarray(matrix, dtype=float)
    check_shape("matrix", matrix, (2, 2))
    check_positive("sigmas", sigmas)
    squares, axes = np.linalg.eigh(matrix)
    width, height = 2.0 * sigmas * np.sqrt(np.maximum(squares, 0.0))
    angle = float(np.degrees(np.arctan2(axes[1, 0], axes[0, 0])))
    ellipse.set(width=float(width), height=float(height), angle=angle)
