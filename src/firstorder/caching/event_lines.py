"""Radii on a plane from a derivative and from the lines around across which E' or E'' jumps.

Where two edges are seen in line, derivatives of irradiance jump across a line on the receivers'
plane (`space.discontinuities`); where round outlines touch, the second one has no bound behind it.
The pointwise metric looks at one derivative at one place and reaches across. Of each straight piece
of such a line the error behind it, seen from the record, is a closed form.
"""

from __future__ import annotations

import math
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from firstorder._argument_checks import check_not_negative, check_positive, is_concrete, nan_unless
from firstorder._display import Module
from firstorder.caching.discontinuities import _checked, _radius_of_error
from firstorder.caching.radii import _coefficient, _law
from firstorder.caching.regions import _checked_limits
from firstorder.numerics._quadrature import gauss_legendre
from firstorder.space.discontinuities import DiscontinuityMesh
from firstorder.space.discontinuities._event_table import TOUCH
from firstorder.space.receiver import Receiver
from firstorder.typing import as_float

_KINDS = ("total", "average", "relative")


def _floats_or_none(a: ArrayLike | None) -> Array | None:
    return None if a is None else as_float(a)


class EventLines(Module):
    """Straight pieces of lines on a plane, and how much derivatives jump across them.

    Attributes:
        start: one end of each piece, in coordinates of the plane, shape (n, 2) [m].
        end: the other one.
        kink: size of the jump of the first derivative across the line, shape (n,) [W/m^3].
        bend: size of the jump of the second derivative, likewise [W/m^4].
        root: where round outlines touch, c of the second derivative `c / sqrt(x)` at the distance x
            behind the line, likewise [W/m^3.5]; `None` where there is none.

    Raises:
        ValueError: if there are not as many of each.

    Example:
        >>> from firstorder.caching import EventLines
        >>> EventLines([[0.0, 1.0]], [[2.0, 1.0]], [0.5], [0.0]).kink.tolist()
        [0.5]
    """

    start: Float[Array, "n 2"] = eqx.field(converter=as_float)
    end: Float[Array, "n 2"] = eqx.field(converter=as_float)
    kink: Float[Array, " n"] = eqx.field(converter=as_float)
    bend: Float[Array, " n"] = eqx.field(converter=as_float)
    root: Float[Array, " n"] | None = eqx.field(converter=_floats_or_none, default=None)

    def __check_init__(self) -> None:
        n = len(self.kink)
        shapes = {"start": (n, 2), "end": (n, 2), "bend": (n,)}
        for name, shape in (
            shapes.items() if self.root is None else {**shapes, "root": (n,)}.items()
        ):
            given = getattr(self, name).shape
            if given != shape:
                raise ValueError(f"Argument `{name}` must have shape {shape}, but has {given}.")

    @classmethod
    def of(cls, mesh: DiscontinuityMesh, at: Receiver) -> EventLines:
        """The lines of a mesh, in coordinates along the tangents of a receiver of its plane.

        Between two points of a line the jump is the mean of theirs.

        Args:
            mesh: lines on the plane of the receiver.
            at: the receiver, whose position is the origin.

        Raises:
            ValueError: if the receiver is traced, or not one.

        Example:
            >>> from firstorder.caching import EventLines
            >>> from firstorder.space import Receiver, Scene, primitive, rectangle
            >>> from firstorder.space.discontinuities import discontinuity_mesh
            >>> lamp = rectangle((0.0, 0.0, 2.0), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0))
            >>> plate = rectangle((0.0, 0.0, 1.0), (0.2, 0.0, 0.0), (0.0, 0.2, 0.0))
            >>> at = Receiver.at((0.0, 0.0, 0.0))
            >>> scene = Scene.of(primitive(lamp, emission=1.0), primitive(plate))
            >>> lines = EventLines.of(discontinuity_mesh(scene, at, points=3, reach=2.0), at)
            >>> bool((lines.kink > 0.0).all()), bool((lines.bend == 0.0).all())
            (True, True)
        """
        if not is_concrete(at) or at.position.shape != (3,):
            raise ValueError("Argument `at` must be one concrete receiver, but is not.")
        frame, origin = np.asarray(at.axes)[:, :2], np.asarray(at.position)
        none = np.zeros((0, 2)), np.zeros((0, 2)), *np.zeros((3, 0))
        pieces: list[tuple[np.ndarray, ...]] = [none]
        touch = mesh.kind == TOUCH
        columns = mesh.order == 1, (mesh.order == 2) & ~touch, touch
        for line, jumps, *which in zip(mesh.lines, mesh.jumps, *columns, strict=True):
            x, jump = (line - origin) @ frame, 0.5 * (jumps[1:] + jumps[:-1])
            pieces.append((x[:-1], x[1:], *(jump * here for here in which)))
        *flat, root = (np.concatenate(column) for column in zip(*pieces, strict=True))
        return cls(*flat, root if np.any(touch) else None)


def expected_error_with_lines(
    radius: ArrayLike,
    derivative: ArrayLike,
    position: ArrayLike,
    lines: EventLines,
    *,
    order: int = 1,
    definition: str = "total",
    value: ArrayLike = 1.0,
) -> Float[Array, "..."]:
    """Error of extrapolation within a disc, from one derivative and the lines that cross it.

    Behind a line at the distance d linear extrapolation goes wrong by `J (x - d)` where E' jumps by
    J, and by `K (x - d)^2 / 2` where E'' does by K, with x across the line. A piece of it acts in
    its shadow, as seen from the record: between the angles psi of its ends from the foot of the
    perpendicular, where it lies within the disc,

        J int (R^3 / 3 cos psi - d R^2 / 2 + d^3 / (6 cos^2 psi)) dpsi
      + K int (R^4 / 8 cos^2 psi - d R^3 / 3 cos psi + d^2 R^2 / 4 - d^4 / (24 cos^2 psi)) dpsi,

    both of which are elementary. Where round outlines touch it is `4 c (x - d)^(3/2) / 3`, and

      4 c / 3 int (2/7 (R cos psi - d)^(7/2) + 2 d / 5 (R cos psi - d)^(5/2)) / cos^2 psi dpsi,

    by eight nodes, which err by less than a thousandth. To these the first missing Taylor term adds
    what it does in `expected_error`. Signs are dropped: an upper bound where the terms compensate,
    exact for one of them.

    Valid for: lines as straight as the pieces that stand for them.

    Args:
        radius: R [m].
        derivative: size of the derivative of order `order + 1` at the record, one number for all
            directions (`derivative_norm`; its mean around is exact at order 1) [W/m^4 at order 1].
        position: of the record, in the coordinates of the lines, shape (..., 2) [m].
        lines: where derivatives jump, and by how much.
        order: of the extrapolation, 0, 1 or 2.
        definition: "total", "average" or "relative". The squared ones do not add.
        value: E at the record, for "relative".

    Raises:
        ValueError: for another order or definition, a negative radius, a value that is asked for
            and not positive, or a position of another number of coordinates.

    Reference: derived here; J12 eq. 68 is the Taylor term at order 1.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching import EventLines, expected_error_with_lines
        >>> line = EventLines([[0.0, -9.0]], [[0.0, 9.0]], [1.5], [0.0])
        >>> round(expected_error_with_lines(1.0, 0.0, jnp.zeros(2), line).item(), 9)  # J 2 R^3 / 3
        1.0
    """
    check_not_negative("radius", radius)
    if definition == "relative":
        check_positive("value", value)
    R = as_float(radius)
    kind, (size, power) = _checked(definition, _KINDS), _term(derivative, order)
    given = size, _place(position), lines, as_float(value)
    return _error(nan_unless(R >= 0, R), given, power, kind)


def radius_with_lines(
    derivative: ArrayLike,
    tolerance: ArrayLike,
    low: ArrayLike,
    high: ArrayLike,
    position: ArrayLike,
    lines: EventLines,
    *,
    order: int = 1,
    definition: str = "total",
    value: ArrayLike = 1.0,
) -> Float[Array, "..."]:
    """The radius at which `expected_error_with_lines` reaches the tolerance.

    As `radius_with_events` along a line: bracketed, halved, and polished by two Newton steps, which
    also carry its first and second derivatives.

    Args:
        derivative: size of the derivative of order `order + 1` at each record.
        tolerance: the error that is accepted, positive.
        low: a smaller radius is not looked for [m].
        high: nor a larger one [m].
        position: of each record, in the coordinates of the lines, shape (..., 2) [m].
        lines: where derivatives jump, and by how much.
        order: of the extrapolation, 0, 1 or 2.
        definition: "total", "average" or "relative".
        value: E at the record, for "relative".

    Returns:
        R [m]; 0 where the error at `low` already exceeds the tolerance, infinity where that at
        `high` does not reach it, for `circular_regions` to hold and to report.

    Raises:
        ValueError: for another order or definition, a tolerance or limit that is not positive,
            limits that are not in order, or positions of another number of coordinates.

    Reference: derived here; J12 eq. 70 without lines.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.caching import EventLines, radius_with_lines
        >>> line = EventLines([[0.0, -9.0]], [[0.0, 9.0]], [1.5], [0.0])
        >>> round(radius_with_lines(0.0, 1.0, 0.01, 9.0, jnp.zeros(2), line).item(), 9)
        1.0
    """
    check_positive("tolerance", tolerance)
    if definition == "relative":
        check_positive("value", value)
    limits = _checked_limits(low, high)
    kind, (size, power) = _checked(definition, _KINDS), _term(derivative, order)
    given = size, _place(position), lines, as_float(value)

    def error(R: Array, given: Any) -> Array:
        return _error(R, given, power, kind)

    return _radius_of_error(error, given, as_float(tolerance), *limits, halvings=40)


def _place(position: ArrayLike) -> Float[Array, "... 2"]:
    x = as_float(position)
    if x.shape[-1:] != (2,):
        raise ValueError(f"Argument `position` must have shape (..., 2), but has {x.shape}.")
    return x


def _term(derivative: ArrayLike, order: int) -> tuple[Array, int]:
    """The total of the Taylor term on a disc of radius 1, and the power of the radius."""
    law = _law("total", order, 2)
    return law.factor * _coefficient(derivative, order, "total", None), law.exponent


def _error(R: Array, given: Any, power: int, definition: str) -> Array:
    size, position, lines, value = given
    total = size * R**power + jnp.sum(_behind(R[..., None], position, lines), axis=-1)
    if definition == "average":
        return total / (math.pi * jnp.where(R > 0.0, R, 1.0) ** 2)
    return total / nan_unless(value > 0, value) if definition == "relative" else total


def _behind(R: Array, position: Array, lines: EventLines) -> Array:
    """Error behind each piece of a line, within discs about records."""
    along = lines.end - lines.start
    square = jnp.sum(along**2, -1)
    there = square > 0.0
    length = jnp.sqrt(jnp.where(there, square, 1.0))
    tx, ty = jnp.moveaxis(along / length[:, None], -1, 0)
    x, y = jnp.moveaxis(lines.start - position[..., None, :], -1, 0)
    d, first = jnp.abs(tx * y - ty * x), tx * x + ty * y
    crossed = there & (d < R)
    half = jnp.sqrt(jnp.where(crossed, R**2 - d**2, 1.0))
    low, high = (jnp.clip(t, -half, half) for t in (first, first + length))
    (J0, K0), (J1, K1) = (_to(t, d, R) for t in (low, high))
    error = jnp.abs(lines.kink) * (J1 - J0) + jnp.abs(lines.bend) * (K1 - K0)
    if lines.root is not None:
        ends = jnp.where(crossed, low, -1.0), jnp.where(crossed, high, 1.0)
        error = error + jnp.abs(lines.root) * _roots_behind(jnp.where(crossed, d, 1.0), R, ends)
    return jnp.where(crossed, error, jnp.where(jnp.isnan(d), d, 0.0))


def _roots_behind(d: Array, R: Array, ends: tuple[Array, Array]) -> Array:
    """Error behind a line, between two places along it, where E'' is `1 / sqrt(x)` there."""
    low, high = (jnp.arctan2(t, jnp.where(d**2 + t**2 > 0.0, d, 1.0)) for t in ends)
    total = jnp.zeros_like(d)
    for node, weight in zip(*gauss_legendre(8), strict=True):
        cosine = jnp.cos(0.5 * (low + high) + 0.5 * node * (high - low))
        x = R * cosine - d
        over = x > 0.0
        root = jnp.sqrt(jnp.where(over, x, 1.0))
        ray = (R - d / cosine) ** 2 * root * (2.0 / 7.0 * x + 0.4 * d)
        total = total + weight * jnp.where(over, ray, 0.0)
    return 2.0 / 3.0 * (high - low) * total


def _to(t: Array, d: Array, R: Array) -> tuple[Array, Array]:
    """Both integrals from the foot of the perpendicular to a place t along the line [m]."""
    square = d**2 + t**2
    off = square > 0.0
    distance = jnp.sqrt(jnp.where(off, square, 1.0))
    sine, cosine = t / distance, d / distance
    angle = jnp.arctan2(t, jnp.where(off, d, 1.0))
    kink = R**3 / 3.0 * sine - d * R**2 / 2.0 * angle + d**2 * t / 6.0
    bend = R**4 / 16.0 * (angle + sine * cosine) - d * R**3 / 3.0 * sine
    return kink, bend + d**2 * R**2 / 4.0 * angle - d**3 * t / 24.0
