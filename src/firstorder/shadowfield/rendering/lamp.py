"""The frame of a rectangular lamp, and the receivers below it."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from firstorder._argument_checks import (
    check_coordinates,
    check_finite,
    check_kind,
    check_positive,
    check_real,
)
from firstorder._display import in_print


def _receiver_rows(receivers: Any) -> Float[np.ndarray, "m 3"]:
    """Receivers as rows of three coordinates.

    Args:
        receivers: in the world [m].

    Raises:
        ValueError: if they are complex, or have another shape.

    Example:
        >>> from firstorder.shadowfield.rendering.lamp import _receiver_rows
        >>> _receiver_rows([[0, 0, 1]]).tolist()
        [[0.0, 0.0, 1.0]]
    """
    rows = np.asarray(receivers)
    check_real("receivers", rows)
    if rows.ndim != 2 or rows.shape[1] != 3:
        raise ValueError(f"Argument `receivers` must have shape (m, 3), but has {rows.shape}.")
    return np.asarray(rows, float)


def below(lamp: LampFrame, receivers: Float[np.ndarray, "m 3"]) -> Bool[np.ndarray, " m"]:
    """Mask of receivers that are finite and below the lamp; no ray can come to the others.

    Args:
        lamp: the lamp.
        receivers: in the world [m].

    Raises:
        TypeError: if `lamp` is none of `lamp_frame`.
        ValueError: if receivers are not rows of three coordinates.

    Example:
        >>> import numpy as np
        >>> from firstorder.shadowfield import lamp_frame
        >>> from firstorder.shadowfield.rendering import below
        >>> lamp = lamp_frame((0, 0, 2), (0, 0.5, 0), (0.5, 0, 0))
        >>> below(lamp, np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 3.0]])).tolist()
        [True, False]
    """
    check_kind("lamp", lamp, LampFrame, "a lamp of `lamp_frame`")
    receivers = _receiver_rows(receivers)
    some = np.all(np.isfinite(receivers), 1)
    return some & (lamp.local(np.where(some[:, None], receivers, lamp.center))[:, 2] > 0.0)


class LampFrame(NamedTuple):
    """A rectangular lamp, and the frame in which its rays are given.

    Attributes:
        center: of the lamp [m].
        axes: rows: unit vectors along its two edges, and its normal, the way it shines.
        half: half of its edges [m].
    """

    center: Float[np.ndarray, "3"]
    axes: Float[np.ndarray, "3 3"]
    half: Float[np.ndarray, "2"]

    __repr__ = in_print

    def local(self, points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
        """Lateral coordinates and depth below the lamp [m]."""
        return (points - self.center) @ self.axes.T

    def world(self, local: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
        """World coordinates of points in the lamp's frame [m]."""
        return self.center + local @ self.axes


def lamp_frame(center, u, v) -> LampFrame:
    """The frame of a rectangle with half-edges u, v that shines along `u x v`.

    Args:
        center: of the rectangle, three numbers [m].
        u: from the center to the middle of one side, three numbers [m].
        v: likewise of the next one.

    Returns:
        The lamp: its center, its axes as rows (along u, along v, the way it shines) and the lengths
        of u and v.

    Raises:
        ValueError: if an argument is not three finite numbers, an edge has no length, or the edges
            are not orthogonal: the filter is a product of two only then.

    Example:
        >>> from firstorder.shadowfield import lamp_frame
        >>> lamp_frame((0, 0, 3), (0, 1, 0), (2, 0, 0)).axes[2].tolist()  # it shines down
        [0.0, 0.0, -1.0]
    """
    given = np.result_type(np.asarray(u), np.asarray(v), np.float32)  # of integers double
    least = max(1e-9, 8.0 * float(np.finfo(given).eps))  # edges in single precision are rounded
    for name, a in (("center", center), ("u", u), ("v", v)):
        check_real(name, np.asarray(a))
        check_coordinates(name, a)
    center, u, v = (np.asarray(a, float) for a in (center, u, v))
    for name, a in (("center", center), ("u", u), ("v", v)):
        check_finite(name, a)
    half = np.array([np.linalg.norm(u), np.linalg.norm(v)])
    check_positive("u", half[0])
    check_positive("v", half[1])
    if abs(u @ v) > least * half[0] * half[1]:
        raise ValueError(f"Arguments `u` and `v` must be orthogonal, but u . v is {u @ v:g}.")
    e, f = u / half[0], v / half[1]
    return LampFrame(center, np.stack([e, f, np.cross(e, f)]), half)
