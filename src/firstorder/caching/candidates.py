"""Candidate records along a line or on a plane: places, and all that a record there would hold.

Candidates are computed once; filling a cache is then a choice among them. A place has d
coordinates: one, the arc length along a line, or two in the tangent plane.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from firstorder._argument_checks import (
    check_broadcast,
    check_finite,
    check_not_negative,
    check_real,
    check_shape,
    is_concrete,
)
from firstorder._display import Module
from firstorder.typing import as_float

BLOCK = 4096  # places differentiated at a time
NAMES = ("value", "gradient", "hessian", "third")


class Candidates(Module):
    """Candidate records at places along a line (d = 1) or on a plane (d = 2).

    Attributes:
        position: arc length, or coordinates in the tangent plane [m].
        value: irradiance E [W/m^d].
        gradient: of E [W/m^(d+1)].
        hessian: of E, which order 2 extrapolates with; None if it is not known [W/m^(d+2)].
        third: third derivatives of E; None if they are not known [W/m^(d+3)].
        tilt: angles by which the normal is turned about the tangent axes; along a line the angle
            of the normal, counter-clockwise from +y. None where the surface is flat [rad].
        minimum: length of the shortest ray; infinite if it was not asked for [m].
        harmonic: harmonic mean of the lengths of rays; infinite if it was not asked for [m].
    """

    position: Float[Array, "m d"]
    value: Float[Array, " m"]
    gradient: Float[Array, "m d"]
    hessian: Float[Array, "m d d"] | None
    third: Float[Array, "m d d d"] | None
    tilt: Float[Array, "m d"] | None
    minimum: Float[Array, " m"]
    harmonic: Float[Array, " m"]

    @staticmethod
    def of(
        position: ArrayLike,
        value: ArrayLike,
        gradient: ArrayLike,
        hessian: ArrayLike | None = None,
        *,
        third: ArrayLike | None = None,
        tilt: ArrayLike | None = None,
        minimum: ArrayLike = math.inf,
        harmonic: ArrayLike = math.inf,
    ) -> Candidates:
        """Candidates from arrays that were computed or gathered.

        Args:
            position: (m, 1) or (m, 2); (m,) for arc lengths along a line [m].
            value: (m,).
            gradient: (m, d).
            hessian: (m, d, d).
            third: (m, d, d, d).
            tilt: (m, d), or what broadcasts to that; along a line also (m,).
            minimum: (m,), or one number.
            harmonic: (m,), or one number.

        Raises:
            ValueError: if shapes do not fit, a number is not finite, or a length is negative.

        Example:
            >>> import numpy as np
            >>> from firstorder.caching import Candidates
            >>> Candidates.of(np.zeros((3, 2)), np.ones(3), np.zeros((3, 2))).dims
            2
        """
        position = _places(position)
        m, d = position.shape

        def checked(name, given, shape):
            if given is None:
                return None
            given = as_float(given)
            check_real(name, given)
            given = given.astype(position.dtype)
            check_shape(name, given, shape)
            check_finite(name, given)
            return given

        def spread(name, given, shape):
            check_broadcast(name, given, shape)
            return jnp.broadcast_to(as_float(given).astype(position.dtype), shape)

        if tilt is not None:
            given = as_float(tilt)
            tilt = spread("tilt", given[:, None] if d == 1 and given.ndim == 1 else given, (m, d))
        found = [
            checked(name, given, (m,) + (d,) * order)
            for order, (name, given) in enumerate(
                zip(NAMES, (value, gradient, hessian, third), strict=True)
            )
        ]
        check_finite("position", position)
        lengths = []
        for name, length in (("minimum", minimum), ("harmonic", harmonic)):
            lengths.append(spread(name, length, (m,)))
            check_not_negative(name, jnp.where(jnp.isposinf(lengths[-1]), 0.0, lengths[-1]))
        return Candidates(position, *found, checked("tilt", tilt, (m, d)), *lengths)

    @staticmethod
    def from_function(
        E: Callable[[Array], Array],
        position: ArrayLike,
        *,
        derivatives: int = 2,
        tilt: ArrayLike | None = None,
        minimum: ArrayLike = math.inf,
        harmonic: ArrayLike = math.inf,
    ) -> Candidates:
        """Candidates for any irradiance that is a function of a place, by nested forward autodiff.

        Args:
            E: jittable function of a place (d,), which gives one number [W/m^d].
            position: (m, 1) or (m, 2); (m,) for arc lengths along a line [m].
            derivatives: order of the highest derivative that is kept, 1 to 3.
            tilt: of the normals, an array as `of` takes it [rad].
            minimum: lengths of the shortest rays, one or m numbers [m].
            harmonic: harmonic means of the lengths of rays, one or m numbers [m].

        Raises:
            ValueError: for another order, or an E that gives more than one number.

        Example:
            >>> import jax.numpy as jnp
            >>> from firstorder.caching import Candidates
            >>> line = Candidates.from_function(lambda x: x**3, jnp.array([2.0]))
            >>> line.gradient.tolist(), line.hessian.tolist()
            ([[12.0]], [[[12.0]]])
            >>> plane = Candidates.from_function(lambda x: x[0] * x[1], jnp.array([[2.0, 3.0]]))
            >>> plane.gradient.tolist(), plane.hessian.tolist()
            ([[3.0, 2.0]], [[[0.0, 1.0], [1.0, 0.0]]])
        """
        _checked_derivatives(derivatives)
        position = _places(position)
        columns = _first(E)
        for _ in range(derivatives):
            columns = _deeper(columns)
        each = eqx.filter_jit(jax.vmap(columns))
        starts = range(0, max(position.shape[0], 1), BLOCK)  # one block of nothing, too
        parts = [each(position[i : i + BLOCK]) for i in starts]
        found = [jnp.concatenate(p) for p in zip(*parts, strict=True)]
        return Candidates.of(
            position,
            *found[:3],
            third=found[3] if derivatives == 3 else None,
            tilt=tilt,
            minimum=minimum,
            harmonic=harmonic,
        )

    @staticmethod
    def on_line(
        x: ArrayLike,
        columns: ArrayLike,
        *,
        tilt: ArrayLike | None = None,
        minimum: ArrayLike = math.inf,
        harmonic: ArrayLike = math.inf,
    ) -> Candidates:
        """Candidates along a line from arc lengths (m,) and E, E', E'', ... as columns (m, k).

        Args:
            x: arc lengths, shape (m,) [m].
            columns: E and its derivatives by arc length, shape (m, k) [W/m, W/m^2, ...].
            tilt: of the normals, an array as `of` takes it [rad].
            minimum: lengths of the shortest rays, one or m numbers [m].
            harmonic: harmonic means of the lengths of rays, one or m numbers [m].

        Raises:
            ValueError: if there are not 2 to 4 columns, or shapes do not fit.

        Example:
            >>> import jax.numpy as jnp
            >>> from firstorder.caching import Candidates
            >>> Candidates.on_line(jnp.array([0.5]), jnp.array([[1.0, 2.0, 4.0]])).hessian.tolist()
            [[[4.0]]]
        """
        data = as_float(columns)
        if data.ndim != 2 or not 2 <= data.shape[1] <= 4:
            raise ValueError(
                f"Argument `columns` must hold 2 to 4 columns, but has shape {data.shape}."
            )
        parts = [data[:, k].reshape((-1,) + (1,) * k) for k in range(data.shape[1])]
        return Candidates.of(
            x,
            *parts[:3],
            third=parts[3] if len(parts) > 3 else None,
            tilt=tilt,
            minimum=minimum,
            harmonic=harmonic,
        )

    @property
    def count(self) -> int:
        """Number of candidates."""
        return self.value.shape[0]

    @property
    def dims(self) -> int:
        """Number of coordinates of a place: 1 along a line, 2 on a plane."""
        return self.position.shape[-1]

    def derivative(self, order: int) -> Float[Array, "..."]:
        """E and its derivatives by their order, of shape (m,) + (d,) * order.

        Raises:
            ValueError: for a derivative that the candidates do not hold.
        """
        found = (self.value, self.gradient, self.hessian, self.third)[order]
        if found is None:
            raise ValueError(
                f"Argument `{NAMES[order]}` must be given for order {order}, but is missing."
            )
        return found

    def at(self, rows) -> Candidates:
        """Some of them: numbers of rows, a mask or a slice."""
        if is_concrete(rows):
            rows = np.arange(self.count)[rows]  # NumPy refuses rows that are not there
        return jax.tree.map(lambda a: a[rows], self)


def _checked_derivatives(derivatives: int) -> int:
    """Order of the highest derivative that candidates keep, which must be 1, 2 or 3."""
    if derivatives not in (1, 2, 3):
        raise ValueError(f"Argument `derivatives` must be 1, 2 or 3, but is {derivatives!r}.")
    return derivatives


def _places(position: ArrayLike) -> Float[Array, "m d"]:
    """Places (m, d); plain arc lengths (m,) become (m, 1)."""
    position = as_float(position)
    check_real("position", position)
    if position.ndim == 1:
        return position[:, None]
    if position.ndim != 2 or position.shape[1] not in (1, 2):
        raise ValueError(
            f"Argument `position` must have shape (m, 1) or (m, 2), but has {position.shape}."
        )
    return position


def _as_number(E: Callable[[Array], Array]) -> Callable[[Array], Float[Array, ""]]:
    """A function of one place that gives one number without an axis, whether E's has one or not."""

    def number(place):
        found = jnp.asarray(E(place))
        if found.size != 1:
            raise ValueError(
                f"Argument `E` must give one number, but gives an array of shape {found.shape}."
            )
        return found.reshape(())

    return number


def _first(E: Callable[[Array], Array]):
    """E as the only entry of a tuple, to which `_deeper` appends."""
    number = _as_number(E)
    return lambda x: (number(x),)


def _deeper(f: Callable[[Array], tuple[Array, ...]]):
    """A function's values with one more: the derivative of the last of them.

    In forward mode, in which loops of an unknown number of steps can be differentiated.
    """

    def last(x):
        found = f(x)
        return found[-1], found

    def slopes(x):
        slope, found = jax.jacfwd(last, has_aux=True)(x)
        return (*found, slope)

    return slopes
