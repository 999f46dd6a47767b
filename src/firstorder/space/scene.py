"""A scene of space: shapes, their materials, and a distant sky.

A scene is a pytree; centres, axes, radiances and albedos are its leaves and can be differentiated.
Shapes of one kind are kept together; a shape's number counts through the groups in the order of
`shapes.kinds.KINDS`.

Shapes may overlap where they look alike (black blockers, say). Where two of different radiance run
into each other, their line of intersection is an edge that no silhouette knows: integrals along
silhouettes are wrong there, rays are right.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Bool, Float

from firstorder._argument_checks import (
    check_index,
    check_not_negative,
    check_one_or_bands,
    not_negative,
)
from firstorder._display import Axes, Module, as_picture, drawn
from firstorder.numerics._vectors import dot
from firstorder.scene._arguments import (
    check_names,
    check_primitives,
    check_sky,
    made_elsewhere,
    numbers,
)
from firstorder.scene._bands import bands_of, by_band, one_band
from firstorder.scene._intersect import picked
from firstorder.scene._primitives import BACK, FRONT, grouped, joined, named
from firstorder.scene._words import told
from firstorder.space.primitives import Material, Primitive
from firstorder.space.shapes._bounds import bounds
from firstorder.space.shapes.kinds import KINDS, Point, Shape


@made_elsewhere
class Scene(Module):
    """Shapes with materials under a distant sky.

    Make one with `Scene.of`. It may be built inside a jitted or differentiated function.

    Attributes:
        groups: the shapes, at most one group a kind.
        material: one row for each shape.
        environment: radiance of the sky as a function of the world direction to where light comes
            from, or a number, the same from everywhere; or one number for each band.

    Example:
        >>> from firstorder.space import Scene, plane, sphere, primitive
        >>> scene = Scene.of(
        ...     primitive(plane((0, 0, 0), (0, 0, 1)), name="floor", albedo=0.5),
        ...     primitive(sphere((0, 0, 1), 0.5), name="ball"),
        ...     environment=1.0,
        ... )
        >>> scene.count, scene.named("floor")
        (2, (1,))
    """

    BANDED: ClassVar = {"environment": 0}

    groups: tuple[Shape, ...]
    material: Material
    environment: Callable[[Array], Array] | Array
    names: tuple[str, ...] = eqx.field(static=True)

    @staticmethod
    def of(
        *things: Primitive,
        environment: Callable[[Array], Array] | ArrayLike | Sequence[float] | None = None,
        **others: Any,
    ) -> Scene:
        """Puts things together.

        Of surfaces in the same place, such as a lamp drawn on a wall, the one that shines is seen,
        and of two that do the later one: of all that a ray meets within a share `eps^(3/4)` of the
        distance to the first.

        Args:
            things: shapes with materials, in any order.
            environment: radiance from beyond all shapes: a number, three or more for bands, or a
                function of the unit direction.
            others: none; the environment's old name `sky` is answered with its new one.

        Raises:
            ValueError: if there is nothing in the scene, or the environment is negative.
            TypeError: if there is another argument, something is no primitive of space, or the
                environment is neither a number nor a function.
        """
        check_names(others, {"sky": "environment"})
        check_primitives(things, Primitive, Shape)
        groups, materials, names = grouped(things, KINDS, joined)
        check_sky(environment, Scene)
        if environment is None:
            environment = 0.0
        if callable(environment):
            if not isinstance(environment, eqx.Module):
                environment = jax.tree_util.Partial(environment)
        else:
            environment = numbers("environment", environment)
            check_one_or_bands("environment", environment)
            check_not_negative("environment", environment)
            environment = not_negative(environment)
        made = Scene(tuple(groups), joined(materials), environment, names)
        bands_of(made)  # refuses those that disagree
        return made

    _repr_html_ = as_picture

    def __repr__(self) -> str:
        return told(self, "space", bounds)

    def plot(self, ax: Axes | None = None, *, view: str = "front", names: bool = True) -> Axes:
        """Draws the outlines of all shapes, seen from far away along an axis, in metres.

        Nearer shapes hide farther ones; of flat shapes that turn their backs to us, such as the
        near wall of a room, only the outline is drawn. What shines is yellow, the rest the brighter
        the higher its albedo. Planes are lines where they are seen edge-on, and else left out.
        `plotting.draw_view` draws what a camera sees.

        Valid for shapes that do not cover each other in a circle (their order is that of middles).

        Args:
            ax: matplotlib axes to draw on; new ones if left out, and no window opens.
            view: from where: "top" (x across, y up), "front" (x, z) or "side" (y, z).
            names: whether names are written.

        Returns:
            The axes.

        Raises:
            ValueError: if the scene is traced, or a batch of scenes, or for another view.

        Example:
            >>> from firstorder.space.library import named_scene
            >>> named_scene("three_spheres").plot(view="top").get_ylabel()
            '$y$ (m)'
        """
        return drawn(self, ax, view=view, names=names)

    @property
    def count(self) -> int:
        """Number of shapes."""
        return len(self.names)

    @property
    def bands(self) -> int | None:
        """Number of bands of its light and its materials; None for one without an axis."""
        return bands_of(self)

    def band(self, number: int) -> Scene:
        """The scene as one of its bands sees it.

        Args:
            number: of the band, from 0.

        Raises:
            ValueError: if there is no such band.
        """
        return one_band(self, number)

    def named(self, name: str) -> tuple[int, ...]:
        """The numbers of the shapes of that name.

        Raises:
            ValueError: if there is none.
        """
        return named(self.names, name)

    def ask(self, index: ArrayLike, question: Callable[[Shape], Any]) -> Any:
        """Result of a function for the shape of that number.

        Raises:
            ValueError: if there is no such shape.
            TypeError: if the index is no integer.
        """
        check_index("index", index, self.count)
        return picked(self.groups, jnp.asarray(index), question)

    def every(self, question: Callable[[Shape], Any]) -> Any:
        """Results of a function for every shape, in the order of their numbers."""
        answers = [jax.vmap(question)(group) for group in self.groups]
        return jax.tree.map(lambda *a: jnp.concatenate(a), *answers)

    def distance(
        self, index: ArrayLike, origin: Point, along: Point, on: ArrayLike = -1
    ) -> Float[Array, ""]:
        """Distance along a ray to one shape, infinity for a miss; differentiable [m].

        Args:
            index: the shape's number.
            origin: of the ray [m].
            along: its direction, a unit vector.
            on: number of the shape on which the origin lies, or -1.
        """
        own = jnp.asarray(on) == jnp.asarray(index)
        return self.ask(index, lambda shape: shape.distance(origin, along, own))

    def normal(self, index: ArrayLike, point: Point) -> Point:
        """The unit normal of a shape at one of its points."""
        return self.ask(index, lambda shape: shape.normal(point))

    def surface(
        self, index: ArrayLike, origin: Point, along: Point, on: ArrayLike = -1
    ) -> tuple[Point, Point, Float[Array, ""]]:
        """Hit of a ray with one shape: point, normal and distance; differentiable.

        For a miss the distance is infinite, and the point is the ray's origin.
        """
        t = self.distance(index, origin, along, on)
        point = origin + jnp.where(jnp.isfinite(t), t, 0.0) * along
        return point, self.normal(index, point), t

    @by_band()
    def emitted(self, index: ArrayLike, point: Point, along: Point) -> Float[Array, "*bands"]:
        """Radiance that a shape emits at a point against the ray that arrives there."""
        front = dot(self.normal(index, point), along) < 0.0
        sides = self.material.emission[jnp.asarray(index)]
        return jnp.where(front, sides[FRONT], sides[BACK])

    @by_band()
    def sky(self, along: Point) -> Float[Array, "*bands"]:
        """Radiance of the sky from a world direction."""
        if callable(self.environment):
            return self.environment(along)
        return self.environment

    def inside(self, eye: Point, on: ArrayLike = -1) -> Bool[Array, ""]:
        """Whether an eye is in a closed shape or on it, where nothing can be seen.

        The shape that it is said to lie on (`on`) does not count.
        """
        found, first = jnp.asarray(False), 0
        for group in self.groups:
            if group.closed:
                own = jnp.arange(first, first + group.count) == jnp.asarray(on)
                found = found | jnp.any(jax.vmap(lambda s: s.inside(eye))(group) & ~own)
            first += group.count
        return found
