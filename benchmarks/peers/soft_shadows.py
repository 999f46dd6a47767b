"""Three soft shadows that every program gets: an area lamp above a floor, with bodies between.

What is asked is E at places of the floor, and how it changes as the place moves along x and y
("receiver") and as the first body does ("blocker").
"""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, ArrayLike

from firstorder.space import Primitive, Scene, box, primitive, rectangle, sphere
from firstorder.space.shapes.kinds import Shape

HEIGHT, HALF, RADIANCE = 3.0, 0.5, 1.0  # of the lamp, a square above the origin that looks down
QUESTIONS = ("receiver", "blocker")
STILL = (0.0, 0.0)


class Ball(NamedTuple):
    """A ball by its centre and radius [m]."""

    center: tuple[float, float, float]
    radius: float

    def shape(self, step: Array) -> Shape:
        """As a shape, after a step along x and y."""
        return sphere(jnp.asarray(self.center) + step, self.radius)


class Block(NamedTuple):
    """A box along the axes by its least and its greatest coordinates [m]."""

    low: tuple[float, float, float]
    high: tuple[float, float, float]

    def shape(self, step: Array) -> Shape:
        """As a shape, after a step along x and y."""
        return box(jnp.asarray(self.low) + step, jnp.asarray(self.high) + step)


class SoftShadow(NamedTuple):
    """Bodies under the lamp, and places on the floor that are in penumbra, drawn once.

    None lies within 4 mm of a visual event: there the gradient itself jumps.
    """

    words: str
    bodies: tuple[Ball | Block, ...]
    places: tuple[tuple[float, float], ...]

    def things(self, step: ArrayLike = STILL) -> list[Primitive]:
        """The bodies, after a step of the first along x and y."""
        move = jnp.append(jnp.asarray(step, dtype=jnp.result_type(float)), 0.0)
        return [
            primitive(body.shape(move if k == 0 else 0.0 * move), name=f"body{k}")
            for k, body in enumerate(self.bodies)
        ]

    def scene(self, step: ArrayLike = STILL) -> Scene:
        """Everything as a scene, after a step of the first body along x and y."""
        floor = rectangle((0.0, 0.0, 0.0), (4.0, 0.0, 0.0), (0.0, 4.0, 0.0))
        lamp = rectangle((0.0, 0.0, HEIGHT), (0.0, HALF, 0.0), (HALF, 0.0, 0.0))
        return Scene.of(
            primitive(floor, name="floor", albedo=1.0),
            primitive(lamp, name="lamp", emission=RADIANCE),
            *self.things(step),
        )


SHADOWS = {
    "ball": SoftShadow(
        "a ball",
        (Ball((0.1, 0.0, 1.5), 0.4),),
        ((-0.27, -0.53), (-0.23, 0.26), (-0.23, 0.5), (0.51, -0.08), (-0.08, -0.07), (0.18, 0.5),
         (-0.54, -0.49), (-0.16, 0.18)),
    ),
    "overlapping": SoftShadow(
        "a ball over a block, which overlap as they are seen",
        (Ball((0.1, 0.05, 1.6), 0.3), Block((-0.35, -0.3, 0.9), (0.1, 0.25, 1.1))),
        ((0.04, -0.39), (-0.33, 0.32), (0.35, -0.07), (-0.37, 0.33), (0.01, -0.4), (-0.44, 0.33),
         (-0.36, 0.22), (-0.4, -0.43)),
    ),
    "box": SoftShadow(
        "a box with upright edges, on the floor",
        (Block((0.1, -0.3, 0.0), (0.5, 0.2, 1.5)),),
        ((-0.19, 0.09), (0.06, 0.05), (-0.2, 0.08), (-0.07, 0.15), (-0.17, 0.14), (0.06, -0.16),
         (0.07, 0.09), (0.04, -0.16)),
    ),
}  # fmt: skip
