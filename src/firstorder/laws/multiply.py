"""Multiply: by a mask, a cosine, a texture, or any other field."""

from __future__ import annotations

from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp

from firstorder.conventions import Frame
from firstorder.errors import Refused
from firstorder.fields._coerce import field_of
from firstorder.fields._haar import triple_products
from firstorder.fields._level_series import level_range
from firstorder.fields._series import Series
from firstorder.fields.covariance import Covariance
from firstorder.fields.extent import Extent
from firstorder.fields.field import Affine, Edge, Field
from firstorder.fields.jet import Jet
from firstorder.fields.spectrum import Grid, Spectrum
from firstorder.fields.wavelet import Wavelet
from firstorder.laws._stairs import Stair, merged, steps_of
from firstorder.laws._window import MOST, WAVES, holding, warn_if_cut
from firstorder.laws.base import FieldImage, Law, Portrait, SpectrumImage
from firstorder.laws.move import Move
from firstorder.typing import ComplexScalar, Frequency, Ray, Scalar


class Multiply(Law):
    """`h(u) = f(u) g(u)`.

    Jet: Leibniz, `grad h = f grad g + g grad f` (R07 eq. 2),
    `Hess h = f Hess g + grad f grad g^T + grad g grad f^T + g Hess f`.
    Spectrum: `H = F (*) G`, a convolution over frequency (D05 eq. 5). It is carried out as
    `sum_k c_k F(Omega - s_k)`, where `c_k`, `s_k` is the Fourier series of the factor on the box
    `window`. The light must vanish outside that box, along every coordinate that the factor depends
    on: what sticks out is multiplied by the factor's periodic continuation. A warning says so where
    that can be seen (concrete values, light of known extent).

    `window.size[i] = N` keeps the waves `|k| <= N / 2` along coordinate i, of period
    `extent[i]`; for a factor of one linear form the largest size counts. Left out is
    `sum_(|k| > N / 2) c_k F(Omega - s_k)`: for smooth light nothing, to rounding, as soon as
    `N / (2 extent)` exceeds the frequency asked for by the light's own bandwidth
    (`8.5 / (2 pi sigma)` for a bell), however slowly `c_k` falls off. For light that has an edge
    itself F falls off as 1 / Omega: then the error is of order 1 (about `1 / N`) behind an edge
    that is parallel to it, and of order 2 behind a parallel kink (a clamped cosine).
    Edges behind one another are therefore merged first: half-planes, slits and combs whose levels
    are parallel, with other products and moves in between, are one stair, known exactly, and meet
    the light in one series (`laws._stairs`). Order 1 remains behind edges of the light itself (a
    `BoxProfile`), and where a convolution or an integral stands between two parallel edges.

    Without a window the box is taken from the light: as far as its spectrum says that it reaches
    (`Spectrum.extent`), 256 waves along each coordinate. Give a window for light without a known
    extent, or to trade waves for time. What box and waves are worth, `with_error` of the product's
    spectrum says.
    Covariance: sums add, exact for Gaussians only.
    Wavelet: triple products, `H_i = C_ijk F_j G_k`.

    Args:
        factor: the field g, or a function of the coordinates, or a number.
        window: box on which the factor is taken periodic for the spectrum, and how many waves
            are kept along each coordinate: 1 is right along one that the factor ignores. Left out,
            a box that holds the light.
        name: what refusals call the multiplication: the event that it belongs to.
        waves: how many are kept along each coordinate of a box that is taken from the light.

    Raises:
        ValueError: if the factor was stated to be over other coordinates than the light.
        Refused: without a window, for the spectrum of light whose extent is not known, or if more
            than 20,000 waves were needed.

    Example:
        >>> from firstorder.fields import gaussian
        >>> from firstorder.laws import Multiply
        >>> g = gaussian((0.0, 0.0), (1.0, 1.0))
        >>> Multiply(g)(g)(1.0, 0.0).item() == g(1.0, 0.0).item() ** 2
        True
    """

    REFINED: ClassVar = ("window", "waves")

    factor: Field = eqx.field(converter=field_of("factor"))
    window: Grid | None = None
    name: str = eqx.field(static=True, default="multiply")
    waves: int = eqx.field(static=True, default=WAVES)

    def __call__(self, portrait: Portrait) -> Portrait:
        """The product as a portrait of the same kind; warns if the window does not hold light."""
        if isinstance(portrait, (Field, Spectrum, Covariance, Wavelet)):
            factor = self.factor.in_frame(portrait.frame, "factor", self.name)
            if factor is not self.factor:
                return Multiply(factor, self.window, self.name, self.waves)(portrait)
        if not isinstance(portrait, Spectrum):
            return super().__call__(portrait)
        if self.window is not None:
            warn_if_cut(self.factor, self.window, portrait, self.name)
        elif any(steps_of(g) is None for g in _factors(self.factor)):
            window = self._held(self.factor, portrait)  # once, and not for each frequency
            held = eqx.tree_at(lambda m: m.window, self, window, is_leaf=lambda x: x is None)
            return Law.__call__(held, portrait)
        return super().__call__(portrait)

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
        """`sum_k c_k F(Omega - s_k)`, parallel edges merged before."""
        mine, rest = self._split(F)
        series = () if rest is None else (self._series(rest, F),)
        if mine:
            others, F = _lifted(F)
            series += tuple(s.series() for s in merged([*mine, *others]))
        return _convolved(series, F, Omega)

    def _split(self, F: Spectrum) -> tuple[list[Stair], Field | None]:
        """The edges of the factor as stairs, periodic where F has its light, and what is left."""
        stairs, rest = [], None
        for g in _factors(self.factor):
            steps = steps_of(g)
            if steps is not None:
                stairs.append(Stair(*steps, *self._period(steps[0], F)))
            else:
                rest = g if rest is None else Multiply(g)(rest)
        return stairs, rest

    def _period(self, level: Affine, F: Spectrum) -> tuple[Scalar, Scalar, int]:
        """Start and end of the period along a level, and the number of harmonics."""
        if self.window is not None:
            return *level_range(level, self.window), max(self.window.size) // 2
        low, high = (end + level.offset for end in self._extent(F).along(level.normal))
        return low, high, self.waves // 2

    def _series(self, factor: Field, F: Spectrum) -> Series:
        """The series of the rest of the factor, on the window or on one that holds the light."""
        return factor.series(self.window or self._held(factor, F))

    def _held(self, factor: Field, F: Spectrum) -> Grid:
        """A window that holds the light."""
        window = holding(self._extent(F), self.waves)
        count = jax.eval_shape(lambda: factor.series(window).coefficients).size
        if count > MOST:
            raise Refused(
                f"{self.name} convolves spectra over a window, which would take {count} waves for "
                "this factor: give it one"
            )
        return window

    def _extent(self, F: Spectrum) -> Extent:
        """Extent of the light; refused if it is not known."""
        extent = F.extent()
        if extent is None:
            raise Refused(
                f"{self.name} convolves spectra over a window, and the extent of this light is not "
                "known: give it one"
            )
        return extent

    def extent(self, extent: Extent, frame: Frame) -> Extent | None:
        """A product lies where the light does."""
        return extent

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


def _factors(field: Field) -> tuple[Field, ...]:
    """The fields of which a field is the product."""
    if type(field) is FieldImage and type(field.law) is Multiply:
        return (*_factors(field.operand), *_factors(field.law.factor))
    return (field,)


def _lifted(F: Spectrum) -> tuple[list[Stair], Spectrum]:
    """Stairs that F was multiplied by on its way, in its coordinates, and F without them."""
    if type(F) is not SpectrumImage:
        return [], F
    law = F.law
    if type(law) is Multiply:
        mine, rest = law._split(F.operand)
        others, bare = _lifted(F.operand)
        if rest is not None:
            window = law.window or law._held(rest, F.operand)
            bare = SpectrumImage(Multiply(rest, window, law.name, law.waves), bare)
        return [*mine, *others], bare
    if type(law) is Move:
        stairs, bare = _lifted(F.operand)
        return [s.moved(law) for s in stairs], SpectrumImage(law, bare)
    return [], F


def _convolved(series: tuple[Series, ...], F: Spectrum, Omega: Frequency) -> ComplexScalar:
    """F convolved with one series after another: the first of them outermost."""
    if not series:
        return F.at(Omega)
    first, *rest = series
    shifted = jax.vmap(lambda w: _convolved(tuple(rest), F, w))(Omega - first.frequencies)
    return jnp.sum(first.coefficients * shifted)


def _triple(F, G):
    """`H_i = sum_jk C_ijk F_j G_k` with the tensor product C, one axis after another."""
    pairs = jnp.multiply.outer(F, G)  # (j, j', ..., k, k', ...)
    n = F.ndim
    for i, size in enumerate(F.shape):
        C = jnp.asarray(triple_products(size), F.dtype)
        # contract axis i of F (always the first left) and its partner of G; append the result
        pairs = jnp.tensordot(pairs, C, axes=((0, n - i), (1, 2)))
    return pairs
