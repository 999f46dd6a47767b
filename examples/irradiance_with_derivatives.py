"""Irradiance below a lamp and a blocker, with its gradient and Hessian, in either world."""

from firstorder import flatland as world  # or: space as world
from firstorder import session

session.start()
dimensions = {3: 2, 5: 3}[len(world.Receiver.freedoms)]


def point(across, up):
    """A place: the last coordinate is up, the others are all the same."""
    return (*[across] * (dimensions - 1), up)


scene = world.Scene.of(
    world.primitive(world.box(point(-0.5, 1.0), point(0.5, 1.1)), emission=1.0),
    world.primitive(world.box(point(0.1, 0.4), point(0.2, 0.5))),
)
receiver = world.Receiver.at(point(0.25, 0.0))
d = world.derivatives(world.irradiance, scene, receiver)
valley = d.along(2.0)  # steps along a surface that curves up by 2 rad/m
print("E", d.value)
print("by", *d.freedoms)
print("gradient", d.gradient)
print("hessian", d.hessian.ravel())
print("gradient in a valley", valley.gradient)
print("hessian in a valley", valley.hessian.ravel())
