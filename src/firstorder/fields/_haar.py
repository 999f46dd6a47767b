"""Haar bases, and the integrals of products of three of their members."""

from __future__ import annotations

import functools

import numpy as np


@functools.cache
def haar_matrix(n: int) -> np.ndarray:
    """Orthonormal Haar matrix of size n = 2^k: row 0 is the mean, row by row finer."""
    if n < 1 or n & (n - 1):
        raise ValueError(f"Argument `n` must be a power of two, but is {n}.")
    if n == 1:
        return np.ones((1, 1))
    coarse = np.kron(haar_matrix(n // 2), [1.0, 1.0])
    fine = np.kron(np.eye(n // 2), [1.0, -1.0])
    return np.vstack([coarse, fine]) / np.sqrt(2.0)


@functools.cache
def triple_products(n: int) -> np.ndarray:
    """`C_ijk = sum_t psi_i psi_j psi_k` on n cells (R07 Fig. 2, after Ng et al. 2004)."""
    W = haar_matrix(n)
    return np.einsum("it,jt,kt->ijk", W, W, W)
