"""Haar bases: written out by hand, and their integrals of products by sums."""

import numpy as np
import pytest

from firstorder.fields._haar import haar_matrix, triple_products


def test_a_basis_of_four_by_hand():
    r = np.sqrt(0.5)
    true = [(0.5, 0.5, 0.5, 0.5), (0.5, 0.5, -0.5, -0.5), (r, -r, 0, 0), (0, 0, r, -r)]
    np.testing.assert_allclose(haar_matrix(4), true, rtol=0.0, atol=1e-15)
    np.testing.assert_array_equal(haar_matrix(1), [[1.0]])
    np.testing.assert_allclose(haar_matrix(2), [(r, r), (r, -r)])


@pytest.mark.parametrize("n", [1, 2, 8, 32])
def test_rows_are_orthonormal(n):
    np.testing.assert_allclose(haar_matrix(n) @ haar_matrix(n).T, np.eye(n), rtol=0.0, atol=1e-14)


def test_triple_products_are_sums_over_cells():
    W, C = haar_matrix(8), triple_products(8)
    for i, j, k in np.ndindex(8, 8, 8):
        assert C[i, j, k] == pytest.approx(sum(W[i, t] * W[j, t] * W[k, t] for t in range(8)))


@pytest.mark.parametrize("n", [0, -1, -2, 3, 6, 12])
def test_sizes_are_powers_of_two(n):
    with pytest.raises(ValueError, match=f"power of two, but is {n}"):
        haar_matrix(n)
