"""Light by azimuth against closed forms that know nothing of slices."""

import jax
import jax.numpy as jnp
import mpmath as mp
import numpy as np
import pytest

from firstorder.space import Scene, receiver, slices, sphere, thing
from firstorder.space.azimuths import parts
from firstorder.space.slices import visibility_by_azimuth
from tests.space import hemispheres

BOUND = 1e-11  # of the issue, with 64 nodes


# Under the ball, beside it, cut by the horizon, and with its edge beside the pole by a hair.
CASES = [
    ((0.3, 0.2, 2.0), 1.0),
    ((1.5, 0.7, 2.0), 0.8),
    ((1.0, 0.5, 1.4), 0.6),
    ((2.0, 0.5, 0.3), 0.6),
    ((2.0, 0.5, 0.6), 0.6),
    ((1.0, 0.0, 2.0), 1.0),
    ((1.0, 0.0, 2.0), 0.99),
    ((1.0, 0.0, 2.0), 0.9999),
]


@pytest.fixture(scope="module")
def table():
    """All cases in one compiled call."""

    def seen(center, radius):
        scene = Scene.of(thing(sphere(center, radius)))
        return visibility_by_azimuth(scene, receiver((0.0, 0.0, 0.0)), 64)

    args = [jnp.asarray(np.stack(a)) for a in zip(*CASES, strict=True)]
    return jax.tree.map(np.asarray, jax.jit(jax.vmap(seen))(*args))


def by_hand(function):
    """Value and gradient, in mpmath, of what a blocked solid angle leaves."""
    with mp.workdps(30):
        h = mp.mpf(10) ** -9

        def at(x, y):
            return function(mp.mpf(x), mp.mpf(y))

        rise = [(at(h, 0) - at(-h, 0)) / (2 * h), (at(0, h) - at(0, -h)) / (2 * h)]
        return float(2 * mp.pi - at(0, 0)), -np.array([float(r) for r in rise])


@pytest.mark.parametrize("i", range(len(CASES)))
def test_one_ball_wherever_the_receiver_is(table, i):
    center, radius = CASES[i]

    def hidden(x, y):
        return hemispheres.cap([center[0] - x, center[1] - y, mp.mpf(center[2])], radius)

    value, gradient = by_hand(hidden)
    assert abs(table.value[i] - value) < BOUND
    np.testing.assert_allclose(table.gradient.total[i], gradient, atol=BOUND)


def test_a_count_of_nothing_is_refused():
    scene = Scene.of(thing(sphere((0.0, 0.0, 2.0), 1.0)))
    with pytest.raises(ValueError, match="Argument `nodes` must be positive, but is 0"):
        visibility_by_azimuth(scene, receiver((0.0, 0.0, 0.0)), 0)


# --- deliberate faults, in one slice -------------------------------------------------------------


def slice_errors():
    """Ends of a ball's interval and rate of B in one slice, against the slice's circle."""
    center, radius, phi = np.array([0.7, 0.3, 1.2]), 0.5, 0.6

    def ends(x):
        gap = center - np.append(x, 0.0)
        u, v = (
            gap[0] * np.cos(phi) + gap[1] * np.sin(phi),
            gap[1] * np.cos(phi) - gap[0] * np.sin(phi),
        )
        middle, half = (
            np.arctan2(u, gap[2]),
            np.arcsin(np.sqrt(radius**2 - v**2) / np.hypot(u, gap[2])),
        )
        return np.array([middle - half, middle + half])

    def one():
        at = receiver((0.0, 0.0, 0.0))
        cut = slices.sliced(
            parts(Scene.of(thing(sphere(center, radius))), at), jnp.asarray(phi), jnp.asarray(0.0)
        )
        return cut.low[0], cut.high[0], slices.edge_rate(cut, slices.Uniform(), at)

    low, high, rate = jax.jit(one)()

    def seen(x):
        a, b = ends(x)
        return 2.0 - (np.cos(a) - np.cos(b))

    h = 1e-5
    truth = np.array([(seen(h * e) - seen(-h * e)) / (2 * h) for e in np.eye(2)])
    return np.max(np.abs([low, high] - ends((0.0, 0.0)))), np.max(np.abs(rate - truth))


def test_one_slice():
    ends, rate = slice_errors()
    assert ends < 1e-14
    assert rate < 1e-9


def _other_turn(part, v, base, lag, right=slices._arc_hits):
    p, k, low, high = right(part, v, base, lag)
    return p, k, high, low


def _no_tangents(part, v, base, lag, right=slices._arc_hits):
    p, k, low, high = right(part, v, base, lag)
    return p, k[..., ::-1], low, high


def _no_sine(cut, T, at, right=slices.edge_rate):
    class Wrong(slices.Uniform):
        def edge(self, w):
            return 1.0 / jnp.sqrt(1.0 - w[..., 2] ** 2)

    return right(cut, Wrong(), at)


@pytest.mark.parametrize(
    ("name", "wrong"),
    [("_arc_hits", _other_turn), ("_arc_hits", _no_tangents), ("edge_rate", _no_sine)],
)
def test_a_fault_is_noticed(monkeypatch, name, wrong):
    monkeypatch.setattr(slices, name, wrong)
    worst = max(slice_errors())
    assert np.isfinite(worst)
    assert worst > 1e-3
