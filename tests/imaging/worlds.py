"""A black ball over a floor, under a uniform sky: its light is a closed form."""

import numpy as np

from firstorder.space import Scene, plane, primitive, sphere

ALBEDO, SKY = 0.7, 1.5
GROUND = plane((0, 0, 0), (0, 0, 1))


def ball_over_floor():
    """The ball has 0.5 m, 1 m up."""
    ball = primitive(sphere((0.0, 0.0, 1.0), 0.5), name="ball", emission=(0.0, 0.0))
    return Scene.of(primitive(GROUND, name="floor", albedo=ALBEDO), ball, environment=SKY)


def open_light(x):
    """Irradiance on the floor."""
    return SKY * np.pi * (1.0 - 0.25 / (1.0 + np.sum(x * x, -1)) ** 1.5)
