"""A point that light falls on, with its frame and the curvature of its surface."""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, Int

from firstorder._argument_checks import (
    check_coordinates,
    check_finite,
    check_shape,
    is_concrete,
    nan_unless,
)
from firstorder._display import Module
from firstorder.conventions import normal_rate
from firstorder.numerics._compiled import compiled
from firstorder.numerics._host import spread
from firstorder.numerics._select import either
from firstorder.numerics._vectors import frame_along
from firstorder.scene._arguments import (
    check_rows,
    made_elsewhere,
    numbers,
    shape_number,
    spread_over,
)
from firstorder.scene._derivatives import SPACE
from firstorder.scene._words import told_receiver


@made_elsewhere
class Receiver(Module):
    """A point on a surface.

    Attributes:
        position: [m].
        axes: the frame: tangents t and b and the normal n as columns, local to global.
        S: shape operator -dn in (t, b); a sphere's with outward normals is -1/R [1/m].
        on: number of the shape on which it lies, -1 for none.

    Raises:
        ValueError: if a number is complex, positions do not have three coordinates, or there is
            not one frame for each.
        TypeError: if there are other arguments.

    Example:
        >>> from firstorder.space import Receiver
        >>> Receiver.at((0.0, 0.0, 0.0), (0.0, 0.0, 2.0)).normal.tolist()
        [0.0, 0.0, 1.0]
    """

    position: Float[Array, "*r 3"] = eqx.field(converter=lambda x: numbers("position", x))
    axes: Float[Array, "*r 3 3"] = eqx.field(converter=lambda a: numbers("axes", a))
    S: Float[Array, "*r 2 2"] = eqx.field(converter=lambda S: numbers("S", S))
    on: Int[Array, "*r"] = eqx.field(default=-1, converter=lambda on: shape_number("on", on))

    freedoms = SPACE

    def __check_init__(self):
        """Refuse other shapes; let one number of a shape stand for many positions."""
        check_coordinates("position", self.position)
        spread_over(self, self.position.shape[:-1], "on")
        check_rows(self, axes=(3, 3), S=(2, 2), on=())

    def __repr__(self) -> str:
        return told_receiver(self, "space")

    @classmethod
    def at(
        cls, position: Any, normal: Any = (0.0, 0.0, 1.0), *, on: ArrayLike = -1, S: Any = None
    ) -> Receiver:
        """A receiver at a point, with the frame that `vectors.orthonormal_frame` gives its normal.

        `flatland.Receiver.at` is the same call in flatland.

        Args:
            position: shape (..., 3) [m].
            normal: shape (..., 3), of any length.
            on: number of the shape on which it lies, -1 for none.
            S: shape operator in that frame, shape (..., 2, 2), zero if left out [1/m].

        Returns:
            The receiver; a traced normal without length gives NaN.

        Raises:
            ValueError: if a number is not finite, the normal is zero, or something has another
                shape.
            TypeError: if something is no number.

        Example:
            >>> from firstorder.space import Receiver
            >>> Receiver.at((0.0, 0.0, 0.0)).axes.tolist()
            [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
        """
        position, normal = numbers("position", position), numbers("normal", normal)
        check_finite("position", position)
        check_finite("normal", normal)
        for name, vector in (("position", position), ("normal", normal)):
            check_coordinates(name, vector)
        axes = _axes(normal)
        if is_concrete(axes) and np.any(np.isnan(np.asarray(axes))):
            raise ValueError("Argument `normal` must have a length, but is the zero vector.")
        shape = jnp.broadcast_shapes(position.shape, normal.shape)[:-1]
        S = np.zeros((2, 2), position.dtype) if S is None else numbers("S", S)
        if S.shape[-2:] != (2, 2):
            raise ValueError(f"Argument `S` must have shape (..., 2, 2), but has {S.shape}.")
        return cls(
            spread(position, (*shape, 3)),
            spread(axes, (*shape, 3, 3)),
            spread(S, (*shape, 2, 2)),
            spread(shape_number("on", on), shape),
        )

    @property
    def normal(self) -> Float[Array, "*r 3"]:
        """The unit normal, local +z."""
        return self.axes[..., 2]

    def moved(self, x: ArrayLike) -> Receiver:
        """The receiver after a walk of x along t and b, its normal carried with the surface.

        The position follows the osculating paraboloid, the normal turns by S x about the axis
        across the walk; both are right to first order, and to second order on a surface of
        constant curvature.

        Valid for one receiver; use `jax.vmap` for many.

        Args:
            x: shape (2,) [m].

        Raises:
            ValueError: if x has another shape.
        """
        x = numbers("x", x)
        check_shape("x", x, (2,))
        rate = normal_rate(self.S, x)
        step = jnp.append(x, -0.5 * jnp.dot(x, rate))
        return Receiver(self.position + self.axes @ step, _turned(self.axes, rate), self.S, self.on)

    def tilted(self, tilt: ArrayLike) -> Receiver:
        """The receiver turned on the spot so that its normal moves along t and b.

        Args:
            tilt: shape (2,) [rad].

        Raises:
            ValueError: if the tilt has another shape.
        """
        tilt = numbers("tilt", tilt)
        check_shape("tilt", tilt, (2,))
        return Receiver(self.position, _turned(self.axes, tilt), self.S, self.on)

    def displaced(self, u: ArrayLike) -> Receiver:
        """The receiver after steps along its axes, and a tilt of its normal.

        Args:
            u: one number for each of `freedoms`, shape (5,) [m, m, m, rad, rad].

        Raises:
            ValueError: if u has another shape.
        """
        u = numbers("u", u)
        check_shape("u", u, (len(SPACE),))
        position = self.position + self.axes @ u[:3]
        return Receiver(position, _turned(self.axes, u[3:]), self.S, self.on)


def receiver(position: Any, normal: Any = (0.0, 0.0, 1.0), S: Any = None, on: ArrayLike = -1):
    """A receiver with the frame that its normal is given: `Receiver.at`.

    Args:
        position: shape (3,) or rows of it [m].
        normal: of any length but zero, likewise.
        S: shape operator, shape (2, 2); left out, the surface is flat [1/m].
        on: number of the shape on which it lies, an integer; -1 for none.

    Example:
        >>> from firstorder.space import receiver
        >>> receiver((0.0, 0.0, 0.0)).axes.tolist()
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    """
    return Receiver.at(position, normal, on=on, S=S)


# The turn that starts by moving n along t, and along b.
TURNS = np.array([[[0, 0, 1], [0, 0, 0], [-1, 0, 0]], [[0, 0, 0], [0, 0, 1], [0, -1, 0]]])


@compiled
def _axes(normal: Float[Array, "*r 3"]) -> Float[Array, "*r 3 3"]:
    """The frame of a normal of any length; NaN for the zero vector."""
    sized = jnp.any(normal != 0.0, -1, keepdims=True)
    return frame_along(nan_unless(sized, normal))


def _turned(axes: Float[Array, "3 3"], tilt: Float[Array, "2"]) -> Float[Array, "3 3"]:
    """The frame turned by |tilt| so that n moves along tilt; exact, and smooth at no turn.

    With K the turn's rate it is turned by `I + sin(a) / a K + (1 - cos(a)) / a^2 K^2`, a = |tilt|.
    """
    K = jnp.einsum("i,ijk->jk", tilt, jnp.asarray(TURNS, axes.dtype))
    square = jnp.dot(tilt, tilt)
    squares = jnp.stack([square, 0.25 * square])
    # Second derivatives of the ratio lose as many digits as the angle has zeros; below the root of
    # a rounding two terms of its series are exact.
    turns = squares > float(jnp.finfo(axes.dtype).eps) ** 0.5
    angle = jnp.sqrt(either(turns, squares, 1.0))
    s, half = jnp.unstack(either(turns, jnp.sin(angle) / angle, 1.0 - squares / 6.0))
    return axes + axes @ (s * K + (0.5 * half * half) * (K @ K))


def in_receiver_frame(receiver: Receiver, w: ArrayLike) -> Float[Array, "*k 3"]:
    """A world vector in the receiver's frame.

    Args:
        receiver: whose frame it is.
        w: vectors of the world, shape (..., 3).

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.space import in_receiver_frame, receiver
        >>> wall = receiver((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
        >>> in_receiver_frame(wall, jnp.array([2.0, 0.0, 0.0])).tolist()  # along its normal
        [0.0, 0.0, 2.0]
    """
    return numbers("w", w) @ receiver.axes
