"""A scene of space: shapes, what they are made of, and a distant sky.

A scene is a pytree; centres, axes, radiances and albedos are its leaves and can be differentiated.
Shapes of one kind are kept together; a shape's number counts through the groups in the order of
`shapes.KINDS`.

Shapes may overlap where they look alike (black blockers, say). Where two of different radiance run
into each other, their line of intersection is an edge that no silhouette knows: integrals along
silhouettes are wrong there, rays are right.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Bool, Float

from firstorder.errors import check_not_negative
from firstorder.numerics.vectors import dot
from firstorder.scene.intersect import picked
from firstorder.scene.primitives import BACK, FRONT, checked, each, grouped, joined, named, sides
from firstorder.space.shapes.kinds import KINDS, Point, Shape
from firstorder.typing import as_float


class Material(eqx.Module):
    """What shapes do with light; one row for each shape.

    Attributes:
        emission: radiance that front and back emit, the same in all directions [W/(m^2 sr)].
        albedo: share of the arriving flux that front and back reflect diffusely, BRDF albedo / pi.
        specular: share that goes into a glossy lobe about the mirrored direction.
        exponent: of that lobe, `cos^exponent`.
    """

    emission: Float[Array, "n 2"]
    albedo: Float[Array, "n 2"]
    specular: Float[Array, " n"]
    exponent: Float[Array, " n"]


@dataclasses.dataclass(frozen=True)
class Thing:
    """Shapes of one kind with one material and one name, before they enter a scene."""

    shape: Shape
    name: str
    material: Material


def thing(
    shape: Shape,
    *,
    name: str = "",
    emission: Any = 0.0,
    albedo: Any = 0.0,
    two_sided: bool = False,
    specular: ArrayLike = 0.0,
    exponent: ArrayLike = 0.0,
) -> Thing:
    """Shapes with a material.

    Args:
        shape: one shape or many of a kind.
        name: by which `Scene.named` finds them.
        emission: radiance of the front, or two numbers, front and back [W/(m^2 sr)].
        albedo: of both sides; or two numbers, front and back.
        two_sided: whether a single emission holds for the back too.
        specular: share reflected into a glossy lobe.
        exponent: of the glossy lobe.

    Raises:
        ValueError: if a number is negative or not finite, or a side would reflect more than all.

    Example:
        >>> from firstorder.space import rectangle, thing
        >>> lamp = thing(rectangle((0, 0, 1), (0, 0.2, 0), (0.2, 0, 0)), name="lamp", emission=1.0)
        >>> lamp.material.emission.tolist()
        [[1.0, 0.0]]
    """
    n = shape.count
    given = {
        "emission": sides(emission, n, two_sided),
        "albedo": sides(albedo, n, True),
        "specular": each(specular, n),
        "exponent": each(exponent, n),
    }
    return Thing(shape, name, Material(**checked(given, ("albedo", "specular"))))


class Scene(eqx.Module):
    """Shapes with materials under a distant sky.

    Make one with `Scene.of`. It may be built inside a jitted or differentiated function.

    Attributes:
        groups: the shapes, at most one group a kind.
        material: one row for each shape.
        environment: radiance of the sky as a function of the world direction to where light comes
            from, or a number, the same from everywhere.

    Example:
        >>> from firstorder.space import Scene, plane, sphere, thing
        >>> scene = Scene.of(
        ...     thing(plane((0, 0, 0), (0, 0, 1)), name="floor", albedo=0.5),
        ...     thing(sphere((0, 0, 1), 0.5), name="ball"),
        ...     sky=1.0,
        ... )
        >>> scene.count, scene.named("floor")
        (2, (1,))
    """

    groups: tuple[Shape, ...]
    material: Material
    environment: Callable[[Array], Array] | Array
    names: tuple[str, ...] = eqx.field(static=True)

    @staticmethod
    def of(*things: Thing, sky: Callable[[Array], Array] | ArrayLike | None = None) -> Scene:
        """Puts things together.

        Args:
            things: shapes with materials, in any order.
            sky: radiance from beyond all shapes: a number, or a function of the unit direction.

        Raises:
            ValueError: if there is nothing in the scene, or the sky is negative.
        """
        groups, materials, names = grouped(things, KINDS, joined)
        if sky is None:
            sky = 0.0
        if callable(sky):
            if not isinstance(sky, eqx.Module):
                sky = jax.tree_util.Partial(sky)
        else:
            check_not_negative("sky", sky)
            sky = as_float(sky)
        return Scene(tuple(groups), joined(materials), sky, names)

    @property
    def count(self) -> int:
        """How many shapes there are."""
        return len(self.names)

    def named(self, name: str) -> tuple[int, ...]:
        """The numbers of the shapes of that name.

        Raises:
            ValueError: if there is none.
        """
        return named(self.names, name)

    def ask(self, index: ArrayLike, question: Callable[[Shape], Any]) -> Any:
        """What the shape of that number answers."""
        return picked(self.groups, jnp.asarray(index), question)

    def every(self, question: Callable[[Shape], Any]) -> Any:
        """What each shape answers, in the order of their numbers."""
        answers = [jax.vmap(question)(group) for group in self.groups]
        return jax.tree.map(lambda *a: jnp.concatenate(a), *answers)

    def distance(
        self, index: ArrayLike, origin: Point, along: Point, on: ArrayLike = -1
    ) -> Float[Array, ""]:
        """Where a ray meets one shape, infinity for a miss; differentiable [m].

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
        """Where a ray meets one shape: point, normal and distance; differentiable.

        For a miss the distance is infinite, and the point is the ray's origin.
        """
        t = self.distance(index, origin, along, on)
        point = origin + jnp.where(jnp.isfinite(t), t, 0.0) * along
        return point, self.normal(index, point), t

    def emitted(self, index: ArrayLike, point: Point, along: Point) -> Float[Array, ""]:
        """Radiance that a shape emits at a point against the ray that arrives there."""
        front = dot(self.normal(index, point), along) < 0.0
        sides = self.material.emission[jnp.asarray(index)]
        return jnp.where(front, sides[FRONT], sides[BACK])

    def sky(self, along: Point) -> Float[Array, ""]:
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
