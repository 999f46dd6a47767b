"""Lamps as lattices of nodes, against NumPy: places, areas, and shadows that are moved by hand."""

import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.imaging import Lamp
from firstorder.imaging._lamps import SampledLight

C, U, V = np.array([0.3, -0.2, 2.0]), np.array([0.1, 0.5, 0.0]), np.array([0.7, 0.2, 0.1])
EVEN = Lamp(C, U, V, 3.0, 5, True, (0.2, -0.1))
GAUSS = Lamp(C, U, V, (1.0, 2.0, 3.0), 3)
X = np.array([0.4, 0.1, -0.3])


def lattice(s, t):
    """Nodes at all of s along u and of t along v, which varies fastest."""
    return np.array([C + a * U + b * V for a in s for b in t])


def test_even_nodes_stand_in_the_middles_of_cells_or_are_shifted():
    middles = np.array([-0.8, -0.4, 0.0, 0.4, 0.8])
    np.testing.assert_allclose(
        Lamp(C, U, V, count=5, even=True).position, lattice(middles, middles), rtol=0.0, atol=1e-15
    )
    shifted = lattice(middles + 0.2 * 0.4, middles - 0.1 * 0.4)
    np.testing.assert_allclose(EVEN.position, shifted, rtol=1e-14)
    np.testing.assert_allclose(EVEN.area, [np.cross(U, V) * 0.16] * 25, rtol=1e-14)


def test_other_nodes_are_those_of_gauss_and_legendre_and_are_not_shifted():
    k, w = np.array([-np.sqrt(0.6), 0.0, np.sqrt(0.6)]), np.array([5.0, 8.0, 5.0]) / 9.0
    np.testing.assert_allclose(GAUSS.position, lattice(k, k), rtol=1e-14)
    true = [np.cross(U, V) * a * b for a in w for b in w]
    np.testing.assert_allclose(GAUSS.area, true, rtol=1e-14)
    moved = Lamp(C, U, V, count=3, shift=(0.2, -0.1))
    np.testing.assert_array_equal(moved.position, GAUSS.position)


def test_what_a_lamp_says_of_itself():
    assert isinstance(EVEN, SampledLight)
    assert EVEN.near
    assert not EVEN.wraps
    assert EVEN.shape == (5, 5)
    assert GAUSS.shape == (3, 3)
    assert (EVEN.even, GAUSS.even) == (True, False)
    assert EVEN.radiance == 3.0
    np.testing.assert_array_equal(GAUSS.radiance, [1.0, 2.0, 3.0])
    plain = Lamp(C, U, V)
    assert (float(plain.radiance), plain.count, plain.even) == (1.0, 8, False)


def test_ways_lead_from_the_point():
    way, area = GAUSS.toward(jnp.asarray(X))
    np.testing.assert_allclose(way, np.asarray(GAUSS.position) - X, rtol=1e-14)
    np.testing.assert_array_equal(area, GAUSS.area)


def cells(place):
    """Coordinates of places on the lamp's plane, in cells along u and v."""
    found = np.linalg.lstsq(np.stack([U, V], 1), (place - C).T, rcond=None)[0].T
    return found * 5.0 / 2.0


def test_half_way_shadows_slide_as_differences_say():
    """A blocker in the middle of the way to a node; the point moves, its shadow against it."""
    m, h = np.cross(U, V), 1e-6
    nodes = np.asarray(EVEN.position)
    blocker = 0.5 * (X + nodes)

    def shadow(x):
        d = blocker - x
        return cells(x + d * ((C - x) @ m / (d @ m))[:, None])

    rate = [(shadow(X + h * e) - shadow(X - h * e)) / (2.0 * h) for e in np.eye(3)]
    np.testing.assert_allclose(EVEN.slide(jnp.asarray(X)), -np.stack(rate, -1), rtol=0.0, atol=1e-8)
    some = np.array([3, 17, 24])
    np.testing.assert_allclose(
        EVEN.slide(jnp.asarray(X), some), EVEN.slide(jnp.asarray(X))[some], rtol=1e-14
    )


def test_in_the_plane_of_the_lamp_shadows_slide_by_a_finite_rate():
    flat = Lamp((0.0, 0.0, 2.0), (1.0, 0.0, 0.0), (0.0, 2.0, 0.0), count=4, even=True)
    found = flat.slide(jnp.array([5.0, 0.0, 2.0]))
    np.testing.assert_allclose(
        found, [[(2.0, 0.0, 0.0), (0.0, 1.0, 0.0)]] * 16, rtol=0.0, atol=1e-15
    )


@pytest.mark.parametrize("unit", [1e-15, 1.0, 1e12])
def test_edges_that_span_no_area_are_refused_in_any_unit(unit):
    u, v = unit * U, unit * V
    with pytest.raises(ValueError, match="must span an area"):
        Lamp(C, u, -3.0 * u)
    with pytest.raises(ValueError, match="must span an area"):
        Lamp(C, u, 0.0 * v)
    with pytest.raises(ValueError, match="must span an area"):
        Lamp(C, u, u + 1e-16 * v)
    Lamp(C, u, u + 1e-13 * v)
    Lamp(C, 1e3 * u, 1e-3 * v)


@pytest.mark.parametrize(
    ("given", "name"),
    [
        ({"count": 0}, "count"),
        ({"radiance": -1.0}, "radiance"),
        ({"radiance": (1.0, -1.0, 0.0)}, "radiance"),
        ({"center": (0.0, np.nan, 0.0)}, "center"),
        ({"u": (0.0, np.inf, 0.0)}, "u"),
        ({"v": (0.0, np.inf, 0.0)}, "v"),
    ],
)
def test_what_is_no_lamp_is_refused(given, name):
    with pytest.raises(ValueError, match=f"`{name}`"):
        Lamp(**({"center": C, "u": U, "v": V} | given))
