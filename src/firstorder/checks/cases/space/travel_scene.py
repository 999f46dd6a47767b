"""Travel of the light of a scene: the light field of one plane is that of another, further on.

A ball and a tilted panel, both painted, under a sky that varies. Brute force follows each ray from
the nearer plane through both with plain vectors and knows neither fields nor shears.
"""

import jax.numpy as jnp
import numpy as np

from firstorder.checks.faults import Fault, twin, twin_law
from firstorder.checks.squares import Case
from firstorder.conventions import SPACE_SLOPE
from firstorder.fields import Grid, Jet
from firstorder.laws import Move
from firstorder.space.light_fields.field import light_field
from firstorder.space.primitives import primitive
from firstorder.space.receiver import Receiver, receiver
from firstorder.space.scene import Scene
from firstorder.space.shapes.build import rectangle, sphere
from firstorder.transport import Travel

D = 0.4
BALL, RADIUS = np.array([0.2, -0.1, 1.6]), 0.45
PANEL = np.array([-0.3, 0.4, 2.1]), np.array([0.5, 0.1, 0.2]), np.array([-0.1, 0.6, 0.1])
PAINT, LIFT = np.array([0.7, -0.4, 0.5]), np.array([0.3, 0.8, 0.6])
POINT, NORMAL = np.array([0.1, 0.2, 0.0]), np.array([0.1, -0.2, 1.0])
# Sky, ball, panel, ball; one ray passes the ball close by.
RAYS = np.array(
    [[0.3, 0.1, 0.9, -0.5], [0.1, -0.2, 0.0, 0.1], [-0.4, 0.1, 0.1, 0.0], [0.4, -0.5, 0.35, -0.1]]
)


def paint(number, point, front, along):
    """Radiance that the shapes send, which varies with the point and with the direction."""
    there = jnp.exp(0.3 * jnp.sum(PAINT * point, -1)) * (1.0 + 0.5 * number)
    return there * (2.0 + jnp.sum(LIFT * along, -1))


def sky(along):
    """Radiance from beyond all shapes."""
    return 1.5 + jnp.sin(2.0 * along[0]) * along[1]


SCENE = Scene.of(primitive(sphere(BALL, RADIUS)), primitive(rectangle(*PANEL)), environment=sky)
PLANE = receiver(POINT, NORMAL)
AXES = np.asarray(PLANE.axes)


def field(scene=SCENE, axes=PLANE.axes, sight=paint):
    """The light on the plane at the distance D, towards the scene."""
    there = Receiver(PLANE.position + D * PLANE.normal, axes, PLANE.S, PLANE.on)
    return light_field(scene, there, radiance=sight)


def brute(u):
    """Plain ray casting from the nearer plane, in NumPy."""
    start = POINT + AXES[:, 0] * u[0] + AXES[:, 1] * u[1]
    along = AXES[:, 2] - AXES[:, 0] * u[2] - AXES[:, 1] * u[3]
    along = along / np.linalg.norm(along)
    hits = []
    middle = (BALL - start) @ along
    square = RADIUS**2 - np.sum((BALL - start - middle * along) ** 2)
    if square > 0.0:
        hits.append((middle - np.sqrt(square), 0))
    center, a, b = PANEL
    t, i, j = np.linalg.solve(np.column_stack([along, -a, -b]), center - start)
    if max(abs(i), abs(j)) < 1.0:
        hits.append((t, 1))
    if not hits:
        return 1.5 + np.sin(2.0 * along[0]) * along[1]
    t, number = min(hits)
    there = np.exp(0.3 * PAINT @ (start + t * along)) * (1.0 + 0.5 * number)
    return there * (2.0 + LIFT @ along)


CASES = (
    Case(
        "travel, a scene in space",
        Travel(D),
        field(),
        Grid.spanning((2, 2, 2, 2), (1.0, 1.0, 1.0, 1.0)),
        tuple(np.zeros(1) for _ in range(4)),
        RAYS,
        brute,
        expected=dict.fromkeys(("spectrum", "covariance", "wavelet"), "refused"),
    ),
)


def instead(light):
    """The fault of a light field: the right step is given the wrong light."""
    return lambda s: twin(s, __call__=lambda _, portrait: s(light))


def flat(light, u):
    """The jet of a light that is the same along all rays that meet one shape."""
    return Jet(light.at(u), jnp.zeros(4), jnp.zeros((4, 4)), SPACE_SLOPE)


EVERY = ("value", "gradient", "hessian")
FAULTS = (
    Fault("flip the shear", lambda s: twin_law(s, lambda m: Move(jnp.linalg.inv(m.M))), EVERY),
    Fault("half as far", lambda s: Travel(0.5 * s.d), EVERY),
    Fault(
        "see through the ball",
        instead(field(Scene.of(primitive(rectangle(*PANEL)), environment=sky))),
        EVERY,
    ),
    Fault("exchange the tangents", instead(field(axes=PLANE.axes[:, [1, 0, 2]])), EVERY),
    Fault("look the mirrored way", instead(field(axes=PLANE.axes * jnp.array([-1, -1, 1]))), EVERY),
    Fault("keep the hit's light", instead(twin(field(), jet=flat)), ("gradient", "hessian")),
)
