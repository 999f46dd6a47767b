"""Programs stay small: what a user waits for at a first call is bounded, for each entry point.

Counting only traces, and a count is the same on every machine. Bounds are what was measured and one
part in twenty; who makes a program smaller lowers its bound. Older versions of JAX trace others.
"""

import jax
import pytest

from tests.first_calls import calls, equations

MOST = {
    "flatland E": 1210,
    "flatland gradient": 1410,
    "flatland Hessian": 2080,
    "scene_d E": 1710,
    "scene_d E''": 3080,
    "flatland radiosity": 2970,
    "space E": 1120,
    "space gradient": 1500,
    "space Hessian": 3360,
    "space derivatives": 3190,
    "space light field, jet": 1480,
    "azimuth integral": 6000,
    "path, jet": 2140,
    "path, spectrum": 385,
    "shadow field, spectrum": 75,
    "cache": 86,
    "tile of pixels": 3990,
}
# These were counted with it.
VERSION = (0, 10)


@pytest.fixture(scope="module")
def entries():
    return calls()


def test_every_entry_point_has_a_bound(entries):
    assert set(entries) == set(MOST)


def test_a_call_inside_counts():
    def called(x):
        return jax.jit(lambda y: y * 2.0)(x) + 1.0

    assert equations(called, 1.0) == 3  # a call, a product, a sum


@pytest.mark.skipif(jax.__version_info__[:2] != VERSION, reason="counted with another JAX")
@pytest.mark.parametrize("name", MOST)
def test_programs_stay_small(entries, name):
    function, args = entries[name]
    assert equations(function, *args) <= MOST[name]
