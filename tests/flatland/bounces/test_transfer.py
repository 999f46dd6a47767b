"""Light that panels send to a receiver, and its derivatives, against quadrature in angle by NumPy.

The scene has walls, a screen whose back is seen, a circle, an ellipse and a hollow arc. Their
panels carry polynomials that jump from panel to panel; some sides have no panels and are black.
"""

import functools
import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss

from firstorder.flatland import Arcs, Circles, Ellipses, Receiver, Scene, primitive
from firstorder.flatland.bounces._panels import Panels
from firstorder.flatland.bounces._transfer import panel_irradiance
from tests.flatland.traced import COUNT, direction, limbs, met, place, scene

NODES = 16

# --- what is there -------------------------------------------------------------------------------

ENDS = {
    (0, 0): [0.0, 1.0],
    (1, 0): [0.0, 0.3, 0.5, 1.0],
    (2, 0): [0.0, 0.6, 1.0],
    (3, 1): [0.0, 0.45, 1.0],
    (4, 0): [0.0, 0.2, 0.4, 0.7, 1.0],
    (5, 0): [0.0, 0.5, 1.0],  # the arc
    (5, 1): [0.0, 0.3, 0.8, 1.0],
    (6, 0): [0.0, 0.35, 0.7, 1.0],
    (7, 0): [0.0, 0.2, 0.45, 0.6, 1.0],
}
SHEETS = [(*sheet, a, b) for sheet, e in ENDS.items() for a, b in itertools.pairwise(e)]
# Radiance on each panel: a polynomial of degree 3 in the parameter, from -1 to 1 on the panel.
LIGHT = np.random.default_rng(1).uniform(0.2, 1.0, (len(SHEETS), 4)) * [2.0, 0.9, -0.7, 0.6]

# Places, angles of the normal, and the shape that the receiver lies on.
PLACES = [
    ((0.3, 0.0), 0.0, 0), ((1.0, 0.4), 0.3, -1), ((-1.14, 0.5), -0.5, -1), ((0.1, 2.1), 0.1, -1),
    ((2.5, 2.8), 2.5, -1), ((-0.48, 0.41), 0.2, -1), ((0.02, 2.45), 0.4, -1),
    ((1.45, 1.45), 2.9, -1),
]  # fmt: skip
STEP = np.array([0.6, -0.3, 0.8])  # along the tangent, along the normal, and a turn


# --- the same by NumPy ---------------------------------------------------------------------------


def sent(eye, on, u):
    """Radiance along rays from what they meet first."""
    nearest, L = np.full(len(u), np.inf), np.zeros(len(u))
    for shape in range(COUNT):
        if shape == on:
            continue
        for t, s, side in met(shape, eye, u):
            value = np.zeros(len(u))
            for (i, j, a, b), powers in zip(SHEETS, LIGHT, strict=True):
                here = (i == shape) & (j == side) & (s >= a) & (s <= b)
                x = 2.0 * (s - a) / (b - a) - 1.0
                value = np.where(here, np.polynomial.Polynomial(powers)(x), value)
            L = np.where(t < nearest, value, L)
            nearest = np.minimum(nearest, t)
    return L


def gaps(eye, n):
    """Directions of all ends of panels and shapes, and of all limbs, from -90 to 90 degrees."""
    seen = [place(i, s) for i in range(COUNT) for s in (0.0, 1.0)]
    seen += [place(i, s) for i, _, a, b in SHEETS for s in (a, b)]
    for shape in (5, 6, 7):
        seen += limbs(shape, eye)
    up, across = direction(n), direction(n + 0.5 * np.pi)
    to = np.array(seen) - eye
    angles = np.arctan2(to @ across, to @ up)
    angles = np.unique(angles[np.abs(angles) < 0.5 * np.pi])
    return np.concatenate([[-0.5 * np.pi], angles, [0.5 * np.pi]])


def truth(eye, n, on):
    """`int L cos d theta` by gaps; s grows like a root beside limbs, which the sine evens out."""
    ends = gaps(eye, n)
    t, w = leggauss(40)
    half = 0.5 * np.diff(ends)[:, None]
    theta = ends[:-1, None] + half * (1.0 + np.sin(0.5 * np.pi * t))
    weight = half * 0.5 * np.pi * np.cos(0.5 * np.pi * t) * w
    L = sent(eye, on, direction(n + theta.ravel())).reshape(theta.shape)
    return np.sum(weight * np.cos(theta) * L)


def true_jet(eye, n, on):
    """Value and two derivatives along STEP, by differences of five values."""
    h, eye = 2e-3, np.array(eye)
    across = np.array([np.cos(n), np.sin(n)])
    f = [
        truth(eye + k * h * (STEP[0] * across + STEP[1] * direction(n)), n + k * h * STEP[2], on)
        for k in range(-2, 3)
    ]
    slope = np.dot(f, [1, -8, 0, 8, -1]) / (12.0 * h)
    return f[2], slope, np.dot(f, [-1, 16, -30, 16, -1]) / (12.0 * h**2)


# --- and here ------------------------------------------------------------------------------------


@functools.cache
def world():
    """Scene, panels, and radiance at the nodes."""
    shape, side, *ends = map(np.array, zip(*SHEETS, strict=True))
    panels = Panels(jnp.array(shape), jnp.array(side), jnp.array(np.stack(ends, -1)), NODES)
    L = np.polynomial.polynomial.polyval(leggauss(NODES)[0], LIGHT.T)
    return scene(), panels, jnp.array(L)


def receivers():
    eye, n, on = map(np.array, zip(*PLACES, strict=True))
    return Receiver(eye, n, on)


@pytest.fixture(scope="module")
def jets():
    """Value and two derivatives along STEP at all places."""

    @jax.jit
    def all_of(scene, panels, L, places):
        def jet(at):
            def E(t):
                return panel_irradiance(scene, panels, L, at.displaced(t * STEP))

            def both(t):
                return jax.jvp(E, (t,), (1.0,))

            (value, slope), (_, bend) = jax.jvp(both, (0.0,), (1.0,))
            return jnp.stack([value, slope, bend])

        return jax.vmap(jet)(places)

    return np.asarray(all_of(*world(), receivers()))


@pytest.mark.parametrize("k", range(len(PLACES)))
def test_light_of_panels_and_both_derivatives_are_those_of_quadrature_in_angle(jets, k):
    value, slope, bend = true_jet(*PLACES[k])
    assert jets[k, 0] == pytest.approx(value, rel=1e-9)
    assert jets[k, 1] == pytest.approx(slope, rel=1e-6, abs=1e-7)
    assert jets[k, 2] == pytest.approx(bend, rel=1e-4, abs=1e-5)


@jax.jit
def gathered(hollow, panels, turn, places):
    """Irradiance at places of the first shape, from panels that all send one."""

    def one(s):
        frame = hollow.frame(0, s)
        even = jnp.ones((*panels.shape.shape, panels.count))
        return panel_irradiance(hollow, panels, even, Receiver(frame.position, frame.n + turn, 0))

    return jax.vmap(one)(places)


@pytest.mark.parametrize("middle", [(3.0, -2.0), (100.0, 50.0)])
@pytest.mark.parametrize("shape", ["circle", "ellipse", "arcs"])
def test_within_a_hollow_shape_of_even_light_every_place_gets_it_from_all_directions(shape, middle):
    """`int cos = 2`, wherever the shape stands: a small one far off is rounded coarsely."""
    made = {
        "circle": Circles(middle, 0.1),
        "ellipse": Ellipses(middle, (0.1, 0.04), 0.4),
        "arcs": Arcs([middle] * 2, 0.1, [0.5, 0.5 + np.pi], np.pi),
    }[shape]
    inside = 0 if shape == "arcs" else 1
    hollow = Scene.of(primitive(made))
    sheets = np.repeat(np.arange(hollow.count), 4)
    ends = np.tile([[0.0, 0.25], [0.25, 0.5], [0.5, 0.75], [0.75, 1.0]], (hollow.count, 1))
    panels = Panels(jnp.array(sheets), jnp.full(sheets.size, inside), jnp.array(ends), 4)

    E = gathered(hollow, panels, np.pi * inside, np.random.default_rng(0).uniform(size=200))
    np.testing.assert_allclose(E, 2.0, rtol=1e-6)
