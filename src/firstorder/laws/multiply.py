"""Multiply: by a mask, a cosine, a texture, or any other field."""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp

from firstorder.errors import Refused
from firstorder.fields.covariance import Covariance
from firstorder.fields.field import Edge, Field
from firstorder.fields.jet import Jet
from firstorder.fields.series import Series
from firstorder.fields.spectrum import Grid, Spectrum
from firstorder.fields.wavelet import Wavelet, triple_products
from firstorder.laws.base import Law
from firstorder.typing import ComplexScalar, Frequency, Ray, Scalar


class Multiply(Law):
    """`h(u) = f(u) g(u)`.

    Jet: Leibniz, `grad h = f grad g + g grad f` (R07 eq. 2),
    `Hess h = f Hess g + grad f grad g^T + grad g grad f^T + g Hess f`.
    Spectrum: `H = F (*) G`, a convolution over frequency (D05 eq. 5). It is carried out as
    `sum_k c_k F(Omega - s_k)`, where `c_k`, `s_k` is the Fourier series of the factor on the box
    `window`: exact for a field that vanishes outside that box.
    Covariance: sums add, exact for Gaussians only.
    Wavelet: triple products, `H_i = C_ijk F_j G_k`.

    Args:
        factor: the field g.
        window: box on which the factor is taken periodic for the spectrum, and how many terms;
            without one, spectra refuse.

    Example:
        >>> from firstorder.fields import gaussian
        >>> from firstorder.laws import Multiply
        >>> g = gaussian((0.0, 0.0), (1.0, 1.0))
        >>> Multiply(g)(g)(1.0, 0.0).item() == g(1.0, 0.0).item() ** 2
        True
    """

    factor: Field
    window: Grid | None = None

    def value(self, f: Field, u: Ray) -> Scalar:
        """Product of the values."""
        return f.at(u) * self.factor.at(u)

    def jet(self, f: Field, u: Ray) -> Jet:
        """Leibniz rule."""
        return self.push(f.jet(u), u)

    def push(self, jet: Jet, u: Ray) -> Jet:
        """Leibniz rule on numbers."""
        f, g = jet, self.factor.jet(u)
        cross = f.gradient[:, None] * g.gradient
        return Jet(
            f.value * g.value,
            f.value * g.gradient + g.value * f.gradient,
            f.value * g.hessian + cross + cross.T + g.value * f.hessian,
            f.frame,
        )

    def edges(self, f: Field) -> tuple[Edge, ...]:
        """Each edge of one factor, its jump times the other.

        Where an edge of f coincides with one of g, the other's value is the mean of its sides, and
        `fg|+ - fg|- = [f] mean(g) + mean(f) [g]`. Integrals do not depend on that: they take the
        light's one-sided limits at each edge.
        """
        other = Multiply(f)
        return tuple(Edge(e.level, self(e.jump)) for e in f.edges()) + tuple(
            Edge(e.level, other(e.jump)) for e in self.factor.edges()
        )

    def series(self, f: Field, window: Grid) -> Series:
        """Series multiply: all sums of frequencies, all products of coefficients."""
        a, b = f.series(window), self.factor.series(window)
        frequencies = a.frequencies[:, None] + b.frequencies
        coefficients = a.coefficients[:, None] * b.coefficients
        return Series(frequencies.reshape(-1, frequencies.shape[-1]), coefficients.ravel())

    def spectrum(self, F: Spectrum, Omega: Frequency) -> ComplexScalar:
        """`sum_k c_k F(Omega - s_k)`."""
        if self.window is None:
            raise Refused("multiply convolves spectra over a window: give it one")
        series = self.factor.series(self.window)
        shifted = jax.vmap(F.at)(Omega - series.frequencies)
        return jnp.sum(series.coefficients * shifted)

    def covariance(self, S: Covariance) -> Covariance:
        """Sum of the two covariances."""
        if self.factor.edges():
            raise Refused("an edge has no finite covariance: soften it, or state a window")
        return Covariance(S.matrix + self.factor.covariance().matrix, S.frame)

    def wavelet(self, W: Wavelet) -> Wavelet:
        """Triple products along every axis: no detour over samples."""
        G = Wavelet.of(self.factor, W.grid).coefficients
        H = _triple(W.coefficients, G) / jnp.sqrt(W.grid.cell)
        return eqx.tree_at(lambda w: w.coefficients, W, H)


def _triple(F, G):
    """`H_i = sum_jk C_ijk F_j G_k` with the tensor product C, one axis after another."""
    pairs = F.reshape(-1, 1) * G.reshape(1, -1)  # (j j' ..., k k' ...)
    n = F.ndim
    pairs = pairs.reshape(F.shape + G.shape)
    for i, size in enumerate(F.shape):
        C = jnp.asarray(triple_products(size), F.dtype)
        # contract axis i of F (always the first left) and its partner of G; append the result
        pairs = jnp.tensordot(pairs, C, axes=((0, n - i), (1, 2)))
    return pairs
