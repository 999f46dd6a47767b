"""A lit scene of space that can be moved, scaled, split and dimmed: what properties speak of."""

from typing import Any, NamedTuple

import jax.numpy as jnp
from hypothesis import strategies as st
from jax.scipy.linalg import block_diag

from firstorder.space import Receiver, Scene, primitive, rectangle, sphere

PLACE = st.floats(-0.9, 0.9)
TURN = st.tuples(*[st.floats(-2.0, 2.0)] * 3)
SHIFT = st.tuples(*[st.floats(-3.0, 3.0)] * 3)
SIZE = st.floats(0.1, 10.0)
SHARE = st.floats(0.05, 0.95)
BRIGHT = st.floats(0.0, 5.0)

LIGHTS = 3  # a lamp, a ball that shines, and the sky
BELOW = (0.0, 0.0, -300.0)  # where nothing is seen, and nothing hides


class Change(NamedTuple):
    """What is done to the scene and to its receiver; by default nothing.

    Attributes:
        turn: rotation vector of the whole [rad].
        shift: of the whole, after the turn [m].
        scale: of the whole, before the shift.
        spin: of the receiver's frame about its normal [rad].
        light: radiance of lamp, ball and sky.
        lamp: share at which the lamp is cut in two; 1 for one piece.
        screen: share at which the screen is cut in two; 1 for one piece.
    """

    turn: Any = (0.0, 0.0, 0.0)
    shift: Any = (0.0, 0.0, 0.0)
    scale: Any = 1.0
    spin: Any = 0.0
    light: Any = (1.0, 0.7, 0.3)
    lamp: Any = 1.0
    screen: Any = 1.0

    @property
    def arrays(self):
        """The same as arrays, so that a compiled function sees one kind of thing."""
        return Change(*(jnp.asarray(part, float) for part in self))


def rotation(turn):
    """The matrix of a rotation vector."""
    turn = jnp.asarray(turn)
    x, y, z = turn
    K = jnp.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    angle = jnp.sqrt(turn @ turn)
    some = jnp.where(angle > 0.0, angle, 1.0)
    return jnp.eye(3) + jnp.sin(angle) / some * K + (1.0 - jnp.cos(angle)) / some**2 * K @ K


def about_normal(spin):
    """The matrix by which steps along a frame, and tilts of it, change when it spins: (5, 5)."""
    flat = rotation(spin * jnp.array([0.0, 0.0, 1.0]))
    return block_diag(flat, flat[:2, :2])


def halves(center, u, v, share):
    """A rectangle in two pieces, cut across v; for a share of 1 the second lies out of sight."""
    center, u, v = (jnp.asarray(a) for a in (center, u, v))
    whole, rest = share >= 1.0, jnp.where(share >= 1.0, 0.5, 1.0 - share)
    first = jnp.where(whole, center, center - rest * v), jnp.where(whole, v, (1.0 - rest) * v)
    second = jnp.where(whole, jnp.asarray(BELOW), center + (1.0 - rest) * v), rest * v
    return [rectangle(middle, u, half) for middle, half in (first, second)]


def changed(change, shape):
    """A shape after the motion of the whole."""
    R = rotation(change.turn)
    center = change.scale * shape.center @ R.T + change.shift
    return type(shape)(center, change.scale * R @ shape.axes)


def lit(change):
    """The scene: a lamp before a screen and a dark ball, and a ball that shines, under a sky."""
    lamp, glow, sky = change.light
    lamps = halves((0.1, -0.05, 1.3), (0.02, 0.41, 0.1), (0.52, 0.01, 0.05), change.lamp)
    screens = halves((0.31, 0.17, 0.62), (0.01, -0.23, 0.03), (0.19, 0.02, 0.08), change.screen)
    balls = sphere((-0.63, 0.42, 0.93), 0.27), sphere((-0.33, -0.21, 0.57), 0.13)
    shown = lamp, jnp.where(change.lamp < 1.0, lamp, 0.0)

    def put(shape, emission=0.0):
        return primitive(changed(change, shape), emission=emission, albedo=0.5, two_sided=True)

    return Scene.of(
        *map(put, lamps, shown),
        *map(put, screens),
        put(balls[0], glow),
        put(balls[1]),
        environment=sky,
    )


def below(change, x, y):
    """A receiver on the ground, a little aslant; its frame is carried along and spun."""
    R = rotation(change.turn)
    at = Receiver.at(jnp.stack([x, y, 0.0 * x]), (0.1, -0.2, 1.0))
    flat = rotation(change.spin * jnp.array([0.0, 0.0, 1.0]))
    position = change.scale * (R @ at.position) + jnp.asarray(change.shift)
    return Receiver(position, R @ at.axes @ flat, at.S)


def as_measured(scale, order):
    """What k steps of each derivative are worth in another unit of length: by gradient entries."""
    steps = jnp.array([1.0, 1.0, 1.0, 0.0, 0.0])
    return scale ** -(steps if order == 1 else steps[:, None] + steps)
