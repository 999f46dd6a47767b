import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.conventions import Frame
from firstorder.fields import Grid, Wavelet, gaussian
from firstorder.fields._haar import haar_matrix, triple_products
from firstorder.laws import Multiply

SIZES = (8, 16)  # not square


def grid():
    return Grid.spanning(SIZES, (2.0, 1.5), (0.2, -0.1))


def light():
    return gaussian((0.21, -0.13), (0.55, 0.4), 0.35, 1.3)


@pytest.mark.parametrize("n", [1, 2, 4, 16])
def test_orthonormal(n):
    W = haar_matrix(n)
    np.testing.assert_allclose(W @ W.T, np.eye(n), rtol=0.0, atol=1e-15)
    assert W[0] == pytest.approx(np.full(n, n**-0.5))


def test_the_rows_are_dilated_and_shifted_copies_of_one_step():
    W = haar_matrix(8)
    for level, first in ((1, 1), (2, 2), (3, 4)):
        width = 8 >> level
        for k in range(first):
            psi = np.zeros(8)
            psi[2 * k * width : (2 * k + 1) * width] = 1.0
            psi[(2 * k + 1) * width : (2 * k + 2) * width] = -1.0
            np.testing.assert_allclose(
                W[first + k], psi / np.linalg.norm(psi), rtol=0.0, atol=1e-15
            )


def test_the_decomposition_is_standard():
    """Every pair of one-dimensional functions, also of unlike scales: a tensor product."""
    W = Wavelet.of(light(), grid())
    f = np.asarray(grid().sample(light()))
    i, j = 5, 1  # fine along x, coarse along theta
    product = np.outer(haar_matrix(8)[i], haar_matrix(16)[j])
    expected = np.sum(f * product) * np.sqrt(grid().cell)
    assert float(W.coefficients[i, j]) == pytest.approx(expected)


def test_back_and_forth_and_parseval():
    W = Wavelet.of(light(), grid())
    f = np.asarray(grid().sample(light()))
    np.testing.assert_allclose(W.samples(), f, rtol=0.0, atol=1e-14)
    assert float(jnp.sum(W.coefficients**2)) == pytest.approx(np.sum(f**2) * grid().cell)


def test_triple_products_multiply_samples():
    g = gaussian((-0.1, 0.2), (0.7, 0.5), -0.2)
    ours = Multiply(g)(Wavelet.of(light(), grid())).samples()
    truth = grid().sample(light()) * grid().sample(g)
    np.testing.assert_allclose(ours, truth, rtol=0.0, atol=1e-13)


def test_triple_products_are_symmetric():
    C = triple_products(8)
    for axes in ((1, 0, 2), (0, 2, 1), (2, 1, 0)):
        np.testing.assert_allclose(C, C.transpose(axes), rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(C[0], np.eye(8) / np.sqrt(8.0), rtol=0.0, atol=1e-15)


@pytest.mark.parametrize("n", [0, 3, 12, -4])
def test_bad_input(n):
    with pytest.raises(ValueError, match=f"`n` must be a power of two, but is {n}"):
        haar_matrix(n)


def test_samples_that_do_not_fit_their_cells_are_one_sentence():
    with pytest.raises(ValueError, match="`samples` must have shape"):
        Wavelet.of_samples(jnp.ones(8), Grid((4,), (1.0,)), Frame(("x",)))
