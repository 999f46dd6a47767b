"""Move: the group of invertible matrices acts on every portrait."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstorder.checks.cases import light
from firstorder.conventions import FLATLAND
from firstorder.errors import Refused
from firstorder.fields import Jet
from firstorder.laws import Move

ENTRY = st.floats(-2.0, 2.0, width=32)
MATRIX = st.tuples(*[ENTRY] * 4).filter(lambda m: abs(m[0] * m[3] - m[1] * m[2]) > 0.2)
SHIFT = st.tuples(ENTRY, ENTRY)
U, OMEGA = jnp.array([0.3, -0.2]), jnp.array([0.2, -0.15])


def as_move(m, c):
    return Move(jnp.asarray(m).reshape(2, 2), jnp.asarray(c))


@jax.jit
def portraits(M, c, N, d):
    """All portraits after two moves, and after the one that should be their product."""
    one, two = Move(M, c), Move(N, d)
    both = Move(M @ N, M @ d + c)

    def drawn(field, image, covariance):
        return (
            field.at(U), field.jet(U), image.at(OMEGA), covariance.matrix,
        )  # fmt: skip

    f = light()
    chained = drawn(two(one(f)), two(one(f.spectrum())), two(one(f.covariance())))
    return chained, drawn(both(f), both(f.spectrum()), both(f.covariance()))


@given(MATRIX, SHIFT, MATRIX, SHIFT)
def test_two_moves_are_one_in_every_portrait(m, c, n, d):
    arrays = jnp.asarray(m).reshape(2, 2), jnp.asarray(c), jnp.asarray(n).reshape(2, 2)
    chained, once = portraits(*arrays, jnp.asarray(d))
    jax.tree.map(
        lambda a, b: np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-11), chained, once
    )


@given(MATRIX, SHIFT)
def test_the_inverse_move_undoes_it_in_every_portrait(m, c):
    M, c = jnp.asarray(m).reshape(2, 2), jnp.asarray(c)
    N = jnp.linalg.inv(M)
    chained, _ = portraits(M, c, N, -N @ c)
    f = light()
    here = (f.at(U), f.jet(U), f.spectrum().at(OMEGA), f.covariance().matrix)
    jax.tree.map(
        lambda a, b: np.testing.assert_allclose(a, b, rtol=1e-8, atol=1e-10), chained, here
    )


@given(st.floats(-3.0, 3.0))
def test_a_rigid_motion_keeps_energy_and_mean_squared_gradient(a):
    """A rotation about any point has determinant 1 and keeps the trace of the covariance."""
    M = jnp.array([[jnp.cos(a), -jnp.sin(a)], [jnp.sin(a), jnp.cos(a)]])
    f = light()
    turned = Move(M, jnp.array([0.4, -1.0]))
    total = abs(turned(f.spectrum()).at(jnp.zeros(2)))
    np.testing.assert_allclose(total, abs(f.spectrum().at(jnp.zeros(2))), rtol=1e-12)
    traces = [jnp.trace(S.matrix) for S in (turned(f.covariance()), f.covariance())]
    np.testing.assert_allclose(*traces, rtol=1e-12)


def test_a_projection_acts_on_jets_and_refuses_spectra():
    tall = Move([[1.0, 0.5, 0.0], [0.0, 1.0, -1.0]], to=FLATLAND.appended("omega"))
    assert tall(light()).jet(jnp.array([0.1, 0.2, 0.3])).hessian.shape == (3, 3)
    with pytest.raises(Refused, match="not square"):
        tall(light().spectrum())
    assert tall.extent(light().spectrum().extent(), FLATLAND) is None


def test_a_jet_at_one_ray_moves_with_the_numbers_alone():
    move = as_move((0.9, -0.6, 0.3, 1.1), (0.1, -0.2))
    jet = light().jet(move.preimage(U))
    pushed, whole = move.push(jet, U), move(light()).jet(U)
    for one, other in zip(jax.tree.leaves(pushed), jax.tree.leaves(whole), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-14)  # two programs, which may round apart
    with pytest.raises(Refused, match="use push"):
        move(Jet(jet.value, jet.gradient, jet.hessian))


def test_a_singular_matrix_is_refused_in_one_sentence():
    with pytest.raises(ValueError, match="Argument `M` must be invertible"):
        Move([[1.0, 2.0], [2.0, 4.0]])
    with pytest.raises(ValueError, match="must be a matrix and its shift"):
        Move([[1.0, 0.0], [0.0, 1.0]], [0.0])


def test_a_frame_that_is_none_is_refused_by_its_name():
    with pytest.raises(TypeError, match=r"`to` must be a `Frame`|violates type hint"):
        Move(np.eye(2), to="x")
