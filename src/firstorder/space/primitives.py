"""Shapes of space with a material, before they enter a scene."""

from __future__ import annotations

import dataclasses
from typing import Any, ClassVar

import jax
from jaxtyping import Array, ArrayLike, Float

from firstorder._display import Module
from firstorder.numerics._vectors import dot
from firstorder.scene._arguments import check_kind
from firstorder.scene._primitives import checked, each, sides
from firstorder.scene._sides import facing_point, turned_to
from firstorder.space.shapes.kinds import Shape


class Material(Module):
    """Emission and reflectance of shapes, front and back; one row for each shape.

    Emission and albedo may have a last axis of bands.

    Attributes:
        emission: radiance that front and back emit, the same in all directions [W/(m^2 sr)].
        albedo: share of the arriving flux that front and back reflect diffusely, BRDF albedo / pi.
        specular: share that goes into a glossy lobe about the mirrored direction.
        exponent: of that lobe, `cos^exponent`.
    """

    BANDED: ClassVar = {"emission": 2, "albedo": 2}

    emission: Float[Array, "n 2 ..."]
    albedo: Float[Array, "n 2 ..."]
    specular: Float[Array, " n"]
    exponent: Float[Array, " n"]


@dataclasses.dataclass(frozen=True)
class Primitive:
    """Shapes of one kind with one material and one name, before they enter a scene."""

    shape: Shape
    name: str
    material: Material


def primitive(
    shape: Shape,
    *,
    name: str = "",
    emission: Any = 0.0,
    albedo: Any = 0.0,
    two_sided: bool = False,
    facing: Any = None,
    specular: ArrayLike = 0.0,
    exponent: ArrayLike = 0.0,
) -> Primitive:
    """Shapes with a material.

    A single emission is the front's. The front is the side of the normal: u x v of a rectangle,
    the side from which the corners of triangles run counter-clockwise, the outside of closed
    shapes.

    Args:
        shape: one shape or many of a kind.
        name: by which `Scene.named` finds them.
        emission: radiance of the front, or two numbers, front and back [W/(m^2 sr)]. Each number
            may be three or more, bands: of one, two or n rows; any number of them, 1 and 2 too, in
            shape (n, 2, bands).
        albedo: of both sides; or two numbers, front and back; bands likewise.
        two_sided: whether a single emission holds for the back too.
        facing: a point towards which the front must look; shapes that show it their back are
            turned round. Left out, they stay as they are [m].
        specular: share reflected into a glossy lobe.
        exponent: of the glossy lobe.

    Raises:
        TypeError: if `shape` is no shape of this world, or something else is no number.
        ValueError: if a number is negative or not finite, if there is not one for each shape, or a
            side would reflect more than all; if `facing` is given for closed shapes, or lies in
            the plane of a shape.

    Example:
        >>> from firstorder.space import rectangle, primitive
        >>> shape = rectangle((0, 0, 1), (0, 0.2, 0), (0.2, 0, 0))
        >>> lamp = primitive(shape, name="lamp", emission=1.0)
        >>> lamp.material.emission.tolist()
        [[1.0, 0.0]]
        >>> primitive(shape, emission=1.0, facing=(0, 0, 2)).shape.axes[0, :, 2].tolist()
        [0.0, 0.0, 1.0]
    """
    check_kind("shape", shape, Shape)
    if facing is not None:
        point = facing_point(facing, 3)
        height = jax.vmap(lambda one: dot(one.normal(one.middle(point)), point - one.center))
        shape = turned_to(shape, height(shape))
    given = {
        "emission": sides(emission, shape, two_sided, "emission"),
        "albedo": sides(albedo, shape, True, "albedo"),
        "specular": each(specular, shape, "specular"),
        "exponent": each(exponent, shape, "exponent"),
    }
    return Primitive(shape, name, Material(**checked(given, ("albedo", "specular"))))
