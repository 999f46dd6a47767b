import jax
import jax.numpy as jnp
import numpy as np

from firstorder.conventions import FLATLAND
from firstorder.fields import Affine, Constant, Function, autodiff_jet, half_plane
from firstorder.laws._one_sided import OneSided, inherited_edges, still

STEPS = half_plane(0.2, 0.5, 2.0) + half_plane(-0.4, 1.0, 0.0) + Function(lambda x, t: x * t)


def test_a_field_goes_on_as_it_is_on_one_side_of_an_edge():
    low, high = (OneSided(STEPS, 0, side) for side in (0.0, 1.0))
    for x in (-1.0, 0.1, 0.2, 0.3):
        rest = (x < -0.4) + 0.3 * x
        np.testing.assert_allclose(low(x, 0.3), 0.5 + rest, rtol=1e-14)
        np.testing.assert_allclose(high(x, 0.3), 2.0 + rest, rtol=1e-14)
        assert high.jets(x, 0.3).gradient.tolist() == [0.3, x]
    assert [-float(e.level.offset) for e in low.edges()] == [-0.4]


def test_edges_are_those_of_the_parameter_and_jump_by_what_it_makes():
    first, second = inherited_edges(STEPS, lambda s: 3.0 * s)
    np.testing.assert_allclose(first.jump(0.7, 0.3), 4.5, rtol=1e-14)
    np.testing.assert_allclose(second.jump(0.7, 0.3), -3.0, rtol=1e-14)
    assert inherited_edges(Constant(1.0), lambda s: s) == ()


def test_a_level_stands_still_along_directions():
    straight = jax.jit(lambda u: still(Affine([2.0, 5.0], 0.1), FLATLAND).at(u))
    assert straight(jnp.array([0.3, 7.0])) == 0.7
    bent = still(Function(lambda x, t: x**2 + t), FLATLAND)
    u = jnp.array([0.3, 7.0])
    ours, theirs = bent.jet(u), autodiff_jet(bent.at, u, FLATLAND)
    assert ours.gradient.tolist() == theirs.gradient.tolist() == [0.6, 0.0]
    assert ours.hessian.tolist() == theirs.hessian.tolist()
