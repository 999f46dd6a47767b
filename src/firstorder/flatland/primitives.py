"""Shapes of flatland with a material, before they enter a scene."""

from __future__ import annotations

import dataclasses
from typing import Any, ClassVar

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from firstorder._display import Module
from firstorder.flatland.shapes.kinds import Shape
from firstorder.numerics._planar import dot_2d, left
from firstorder.scene._arguments import check_kind
from firstorder.scene._primitives import checked, each, sides
from firstorder.scene._sides import facing_point, turned_to


class Material(Module):
    """Emission and reflection of shapes, front and back; one row for each shape.

    Emission and albedo may have a last axis of bands.

    Attributes:
        emission: radiance that the front and the back emit, the same in all directions [W/(m rad)].
        albedo: share of the arriving flux that front and back reflect diffusely, BRDF albedo / 2.
        mirror: share that is reflected as by a mirror.
        specular: share that goes into a glossy lobe about the mirrored direction.
        exponent: of that lobe, `cos^exponent`.
        ior: index of refraction behind the front over that before it; 0 for what is opaque.
    """

    BANDED: ClassVar = {"emission": 2, "albedo": 2}

    emission: Float[Array, "n 2 ..."]
    albedo: Float[Array, "n 2 ..."]
    mirror: Float[Array, " n"]
    specular: Float[Array, " n"]
    exponent: Float[Array, " n"]
    ior: Float[Array, " n"]


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
    mirror: ArrayLike = 0.0,
    specular: ArrayLike = 0.0,
    exponent: ArrayLike = 0.0,
    ior: ArrayLike = 0.0,
) -> Primitive:
    """Shapes with a material.

    A single emission is the front's. The front is the side of the normal: to the left of the
    travel from start to end of segments and arcs, the outside of closed shapes.

    Args:
        shape: one shape or many of a kind.
        name: by which `Scene.named` finds them.
        emission: radiance of the front; or two numbers, front and back; for n > 2 shapes also a
            vector of n, the front of each [W/(m rad)]. Each number may be three or more, bands: of
            one, two or n rows; any number of them, 1 and 2 too, in shape (n, 2, bands).
        albedo: of both sides; or two numbers, front and back; bands likewise.
        two_sided: whether a single emission holds for the back too.
        facing: a point towards which the front must look; shapes that show it their back are
            turned round (an arc is judged at its middle). Left out, they stay as they are [m].
        mirror: share reflected as by a mirror.
        specular: share reflected into a glossy lobe.
        exponent: of the glossy lobe.
        ior: index of refraction behind the front, relative; 0 if opaque.

    Raises:
        TypeError: if `shape` is no shape of this world, or something else is no number.
        ValueError: if a number is negative or not finite, if there is not one for each shape, or a
            side would reflect more than all; if `facing` is given for closed shapes, or lies in
            the plane of a shape.

    Example:
        >>> from firstorder.flatland import Segments, primitive
        >>> lamp = primitive(Segments((0.5, 1.0), (-0.5, 1.0)), name="lamp", emission=1.0)
        >>> lamp.material.emission.tolist()
        [[1.0, 0.0]]
        >>> turned = primitive(Segments((-0.5, 1.0), (0.5, 1.0)), emission=1.0, facing=(0.0, 0.0))
        >>> turned.shape.start.tolist()
        [[0.5, 1.0]]
    """
    check_kind("shape", shape, Shape)
    if facing is not None:
        point = facing_point(facing, 2)
        start, along, _ = jax.vmap(lambda one: one.motion(jnp.asarray(0.5)))(shape)
        shape = turned_to(shape, dot_2d(left(along), point - start))
    given = {
        "emission": sides(emission, shape, two_sided, "emission"),
        "albedo": sides(albedo, shape, True, "albedo"),
        "mirror": each(mirror, shape, "mirror"),
        "specular": each(specular, shape, "specular"),
        "exponent": each(exponent, shape, "exponent"),
        "ior": each(ior, shape, "ior"),
    }
    return Primitive(shape, name, Material(**checked(given, ("albedo", "mirror", "specular"))))
