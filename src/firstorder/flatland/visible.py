"""The hemicircle above a receiver, cut at every silhouette, and the shape in each gap.

No direction is sampled. All events (ends of shapes, points of tangency, crossings) are sorted by
angle; between two neighbours one shape is nearest throughout, and one ray finds it. The angles are
differentiable functions of the receiver and of the scene, so an integral over the gaps is exact
under differentiation, shadow edges included. The order and the numbers of the shapes have no
derivative (`_hemicircle` finds them).

Where two events fall together (a visual event: two edges in line) derivatives jump. What comes out
is the one-sided derivative of the side on which the nearer edge hides the farther one.
"""

from __future__ import annotations

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, Int

from firstorder._argument_checks import (
    check_finite,
    check_one,
    check_real,
    is_concrete,
    nan_unless,
    warn_of_degrees,
)
from firstorder._display import Module
from firstorder.conventions import direction
from firstorder.flatland._hemicircle import HORIZON, Between, Cuts, cuts_of, seen_between
from firstorder.flatland.scene import Scene
from firstorder.flatland.shapes._base import own_unit
from firstorder.numerics._compiled import compiled_after
from firstorder.numerics._host import hosted, spread
from firstorder.numerics._planar import cross_2d, dot_2d
from firstorder.scene._arguments import (
    check_asked_one,
    check_kind,
    check_rows,
    made_elsewhere,
    numbers,
    shape_number,
    spread_over,
)
from firstorder.scene._derivatives import FLATLAND
from firstorder.scene._questions import check_question
from firstorder.scene._words import told_receiver
from firstorder.typing import as_array, as_float


@made_elsewhere
class Receiver(Module):
    """A point that light falls on, and the angle of its normal.

    Args:
        position: [m].
        n: angle of the normal, counter-clockwise from +y [rad].
        on: number of the shape on which it lies, -1 for none.

    Raises:
        ValueError: if positions do not have two coordinates, a number is complex, or there is not
            one angle for each position.
        TypeError: if there are other arguments.

    Example:
        >>> from firstorder.flatland import Receiver
        >>> Receiver((0.0, 0.0), 0.0).normal.tolist()
        [-0.0, 1.0]
    """

    position: Float[Array, "*r 2"] = eqx.field(converter=lambda p: numbers("position", p))
    n: Float[Array, "*r"] = eqx.field(converter=lambda n: _angle("n", n))
    on: Int[Array, "*r"] = eqx.field(default=-1, converter=lambda on: shape_number("on", on))

    freedoms = FLATLAND

    def __check_init__(self):
        """Refuse other coordinates; let one angle and one number stand for many positions."""
        check_real("position", self.position)
        _check_coordinates("position", self.position)
        spread_over(self, self.position.shape[:-1], "n", "on")
        check_rows(self, n=(), on=())

    def __repr__(self) -> str:
        return told_receiver(self, "flatland")

    @classmethod
    def at(cls, position: Any, normal: Any = (0.0, 1.0), *, on: ArrayLike = -1) -> Receiver:
        """A receiver at a point, with a normal given as a vector or as an angle.

        `n = atan2(-normal_x, normal_y)`, as `conventions.direction` has it: `direction(n)` is the
        normal. `space.Receiver.at` is the same call in space.

        Args:
            position: shape (..., 2) [m].
            normal: shape (..., 2), of any length; or a single number, its angle counter-clockwise
                from +y [rad]. Several angles go to `Receiver(position, n)`.
            on: number of the shape on which it lies, -1 for none.

        Returns:
            The receiver; a traced normal without length gives NaN.

        Raises:
            ValueError: if a number is not finite, a vector has not two coordinates, or the normal
                is zero.
            TypeError: if something is no number.

        Example:
            >>> from firstorder.flatland import Receiver
            >>> Receiver.at((0.5, 0.0)).n.item(), Receiver.at((0.5, 0.0), 0.25).n.item()
            (0.0, 0.25)
            >>> round(Receiver.at((0.5, 0.0), (-2.0, 2.0)).n.item(), 4)  # 45 degrees
            0.7854
        """
        position, normal = numbers("position", position), numbers("normal", normal)
        check_finite("position", position)
        check_finite("normal", normal)
        _check_coordinates("position", position)
        n = normal
        if normal.ndim == 0:
            warn_of_degrees("normal", normal)
        else:
            _check_coordinates("normal", normal)
            xp, normal = hosted(normal)
            sized = xp.any(normal != 0.0, -1)
            if is_concrete(sized) and not np.all(sized):
                raise ValueError("Argument `normal` must have a length, but is the zero vector.")
            n = as_array(nan_unless(sized, xp.arctan2(-normal[..., 0], normal[..., 1])))
        shape = jnp.broadcast_shapes(position.shape[:-1], n.shape)
        return cls(
            spread(position, (*shape, 2)), spread(n, shape), spread(shape_number("on", on), shape)
        )

    @classmethod
    def on_shape(cls, scene: Scene, index: ArrayLike, s: ArrayLike) -> Receiver:
        """The receiver at the parameter s of a shape, on its front side.

        It is not called `on`, because that is the attribute that holds the shape's number.

        Args:
            scene: the shapes.
            index: the shape's number.
            s: where on it, in [0, 1] along its travel.

        Raises:
            ValueError: if there is no such shape, or s is none of [0, 1].
            TypeError: if the index is no integer.

        Example:
            >>> from firstorder.flatland import Receiver, Scene, Segments, primitive
            >>> scene = Scene.of(primitive(Segments((-1.0, 0.0), (1.0, 0.0))))
            >>> Receiver.on_shape(scene, 0, 0.75).position.tolist()
            [0.5, 0.0]
        """
        check_kind("scene", scene, Scene)
        check_one("s", s)
        frame = scene.frame(index, s)
        return cls(frame.position, frame.n, as_array(index))

    @property
    def normal(self) -> Float[Array, "*r 2"]:
        """The unit normal, local +y."""
        return direction(self.n)

    @property
    def tangent(self) -> Float[Array, "*r 2"]:
        """The unit vector along local +x."""
        return jnp.stack([jnp.cos(self.n), jnp.sin(self.n)], -1)

    def moved(self, x: ArrayLike) -> Receiver:
        """The receiver after a step x along its tangent, its normal held fixed [m]."""
        return self.displaced(jnp.stack([as_float(x), 0.0, 0.0]))

    def tilted(self, angle: ArrayLike) -> Receiver:
        """The receiver with its normal turned counter-clockwise in place [rad]."""
        return self.displaced(jnp.stack([0.0, 0.0, as_float(angle)]))

    def displaced(self, u: Float[Array, "3"]) -> Receiver:
        """The receiver after steps along its tangent and its normal, and a turn.

        Args:
            u: one number for each of `freedoms` [m, m, rad].
        """
        u = numbers("u", u)
        position = self.position + u[0] * self.tangent + u[1] * self.normal
        return Receiver(position, self.n + u[2], self.on)


class View(Module):
    """The hemicircle above a receiver, cut into gaps.

    Attributes:
        angles: ends of the gaps from -pi/2 to pi/2, counter-clockwise from the normal [rad];
            gaps may be empty.
        seen: number of the nearest shape in each gap, -1 for none.
    """

    angles: Float[Array, " m_1"]
    seen: Int[Array, " m"]


def receiver(scene: Scene, index: ArrayLike, s: ArrayLike) -> Receiver:
    """The receiver at the parameter s of a shape, on its front side: `Receiver.on_shape`.

    Example:
        >>> from firstorder.flatland import Scene, Segments, receiver, primitive
        >>> scene = Scene.of(primitive(Segments((-1.0, 0.0), (1.0, 0.0))))
        >>> receiver(scene, 0, 0.75).position.tolist()
        [0.5, 0.0]
    """
    return Receiver.on_shape(scene, index, s)


def _angle(name: str, n: Any) -> Array:
    """An angle that is likely none in degrees; JAX's own arrays are not looked at."""
    if isinstance(n, (int, float, np.ndarray)):
        warn_of_degrees(name, n, 5)
    return numbers(name, n)


def _check_coordinates(name: str, vector: Array) -> None:
    """Refuse what is no vector of the plane."""
    if not vector.ndim or vector.shape[-1] != 2:
        raise ValueError(
            f"Argument `{name}` must have two coordinates, but has shape {vector.shape}."
        )


def local_angle(receiver: Receiver, point: ArrayLike) -> Float[Array, ""]:
    """Angle of a point, counter-clockwise from the normal; pi/2 for the receiver itself [rad].

    Args:
        receiver: where it is seen from.
        point: what is seen, shape (2,) [m].

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.flatland import Receiver, local_angle
        >>> left = local_angle(Receiver((0.0, 0.0), 0.0), jnp.array([-1.0, 1.0]))
        >>> round(left.item(), 6)  # pi / 4
        0.785398
    """
    u = as_float(point) - receiver.position
    away = jnp.sum(jnp.abs(u)) != 0.0  # NaN is somewhere, and stays NaN
    up, side = dot_2d(receiver.normal, u), cross_2d(receiver.normal, u)
    angle = jnp.arctan2(jnp.where(away, side, 1.0), jnp.where(away, up, 0.0))
    return jnp.clip(angle, -HORIZON, HORIZON)


@compiled_after(check_question)
def view(scene: Scene, at: Receiver, *, cuts: ArrayLike | None = None) -> View:
    """Cuts the hemicircle above a receiver at all silhouettes and names the shape in each gap.

    Args:
        scene: the shapes.
        at: one receiver; use `jax.vmap` for many.
        cuts: further points in whose directions to cut, as ends of panels of a surface.

    Returns:
        The gaps, in order; differentiable angles.

    Raises:
        ValueError: for a row of receivers.

    Example:
        >>> from firstorder.flatland import Receiver, Scene, Segments, primitive, view
        >>> scene = Scene.of(primitive(Segments((1.0, 1.0), (-1.0, 1.0))))
        >>> seen = view(scene, Receiver((0.0, 0.0), 0.0))
        >>> (seen.angles / jnp.pi).round(2).tolist(), seen.seen.tolist()
        ([-0.5, -0.25, 0.25, 0.5], [-1, 0, -1])
    """
    check_asked_one(scene, Scene, at, Receiver, bands=True)
    if cuts is not None:
        cuts = as_float(cuts)
    scene, at, cuts = _in_own_unit(scene, at, cuts)
    where = cuts_of(scene, at, cuts)
    return _view(where, seen_between(scene, at, where))


def _view(cuts: Cuts, seen: Between) -> View:
    """The gaps of a view by their angles."""
    angles = jnp.arctan2(cuts.sine, cuts.cosine)[seen.order]
    edge = jnp.full((1,), HORIZON, angles.dtype)
    return View(jnp.concatenate([-edge, angles, edge]), seen.shape)


def _in_own_unit(
    scene: Scene, at: Receiver, cuts: Float[Array, "c 2"] | None = None
) -> tuple[Scene, Receiver, Float[Array, "c 2"] | None]:
    """Shapes, receiver and cuts in a unit near the scene's size, in which the view is the same.

    Point lights stay where they were: they cut nothing, and what they send depends on the unit.
    """
    unit = own_unit(scene.groups)  # without the receiver: many of them share one scene
    groups = tuple(group.in_unit(unit) for group in scene.groups)
    scene = eqx.tree_at(lambda s: s.groups, scene, groups)
    at = eqx.tree_at(lambda r: r.position, at, at.position / unit)
    return scene, at, None if cuts is None else cuts / unit
