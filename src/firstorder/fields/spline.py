"""A field from samples: the tensor cubic spline through them, with every portrait in closed form.

`f(u) = sum_k c_k prod_i beta((u_i - u_ki) / h_i)` with the cubic B-spline `beta`, whose
transform is `sinc^4`. Twice continuously differentiable, so jets are exact derivatives of the
spline; of a smooth field they miss the value by O(h^4), the gradient by O(h^3), the Hessian by
O(h^2).
"""

from __future__ import annotations

import functools
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from firstorder._argument_checks import check_finite, check_shape, nan_unless
from firstorder.conventions import UNSTATED, Frame
from firstorder.errors import Refused
from firstorder.fields.covariance import Covariance
from firstorder.fields.extent import Extent
from firstorder.fields.field import Field
from firstorder.fields.jet import Jet
from firstorder.fields.spectrum import Grid, SampledSpectrum, Spectrum
from firstorder.numerics._compiled import compiled
from firstorder.numerics._select import whole_below
from firstorder.numerics._splines import cubic_b_spline
from firstorder.typing import ComplexScalar, Frequency, Ray, Scalar, as_float

BOUNDARIES = ("zero", "open", "periodic")


class Spline(Field):
    """The cubic spline through samples on a grid, in any dimension.

    What holds beyond the samples is chosen per axis:

    - `"zero"`: dark; the spline falls to zero within two steps of the last sample. Order 4 for
      light that has died out there, and only for such light.
    - `"open"`: unknown; the ends are fitted without an assumption ("not a knot"), order 4 up to
      half a step beyond the last sample, and NaN further out. Spectrum and covariance refuse.
    - `"periodic"`: the grid's extent is one period (a circle of directions). The spectrum then
      holds at whole multiples of `1 / period`, where it is the period times the Fourier
      coefficient.

    Differentiable in the samples (build the field inside the function that is differentiated)
    and in `coefficients`, the leaf.

    Args:
        samples: values on `grid`, shape `grid.size`.
        grid: where they lie; at least four along every axis.
        frame: names of the coordinates.
        boundary: one of the above, or one for each axis.

    Raises:
        ValueError: if the samples do not fit the grid, are not finite, or a boundary is unknown.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.fields import Grid, Spline
        >>> f = Spline(jnp.eye(5), Grid((5, 5), (0.1, 0.1)))
        >>> round(f(0.1, 0.1).item(), 6), round(f(0.1, 0.0).item(), 6)
        (1.0, 0.0)
    """

    coefficients: Float[Array, "..."]
    grid: Grid
    frame: Frame = eqx.field(static=True)
    boundary: tuple[str, ...] = eqx.field(static=True)

    def __init__(
        self,
        samples,
        grid: Grid,
        frame: Frame = UNSTATED,
        boundary: str | tuple[str, ...] = "zero",
    ):
        """Fit the spline; see the class."""
        samples = as_float(samples)
        boundary = (boundary,) * len(grid.size) if isinstance(boundary, str) else tuple(boundary)
        check_shape("samples", samples, grid.size)
        check_finite("samples", samples)
        if frame.dims != len(grid.size):
            raise ValueError(
                f"Argument `grid` must have {frame.dims} axes, but has {len(grid.size)}."
            )
        if min(grid.size) < 4:
            raise ValueError(
                f"Argument `grid` must have 4 samples along every axis, but has {grid.size}."
            )
        if len(boundary) != len(grid.size) or not set(boundary) <= set(BOUNDARIES):
            raise ValueError(
                f"Argument `boundary` must name one of {BOUNDARIES} for each axis, "
                f"but is {boundary}."
            )
        self.grid, self.frame, self.boundary = grid, frame, boundary
        fits = [_fit(n, b) for n, b in zip(grid.size, boundary, strict=True)]
        self.coefficients = _along_axes(samples, fits)

    @classmethod
    def of(cls, field: Field, grid: Grid, boundary: str | tuple[str, ...] = "zero") -> Spline:
        """The spline through a field's values on a grid.

        Example:
            >>> from firstorder.fields import Affine, Grid, Spline
            >>> soft = Spline.of(Affine([2.0, 0.0], 1.0), Grid((8, 8), (0.25, 0.25)))
            >>> round(soft(0.125, 0.125).item(), 6)
            1.25
        """
        return cls(grid.sample(field), grid, field.frame, boundary)

    @property
    def knots(self) -> Grid:
        """Centres of the coefficients' splines: two more at both ends of an open axis."""
        grow = [4 * (b == "open") for b in self.boundary]
        size = tuple(n + g for n, g in zip(self.grid.size, grow, strict=True))
        return Grid(size, self.grid.step, self.grid.center)

    def _local(self, u: Ray) -> tuple[Array, list[Array]]:
        """The 4 x ... x 4 coefficients that reach `u`, and how many steps away each is."""
        knots, index, distances = self.knots, [], []
        for i, (n, h, b) in enumerate(zip(knots.size, knots.step, self.boundary, strict=True)):
            t = (u[i] - knots.axis(i)[0]) / h
            first = whole_below(t).astype(int) - 1
            if b == "periodic":
                index.append((first + jnp.arange(4)) % n)
            else:
                # Beyond the ends the weights vanish by themselves.
                first = jnp.clip(first, 0, n - 4)
                index.append(first + jnp.arange(4))
            if b == "open":
                t = nan_unless((t >= 1.5) & (t <= n - 2.5), t)
            distances.append(t - (first + jnp.arange(4)))
        return self.coefficients[jnp.ix_(*index)], distances

    def at(self, u: Ray) -> Scalar:
        """The spline."""
        block, distances = self._local(u)
        for t in distances:  # the first axis left, each time
            weight = cubic_b_spline(t)[0]
            block = jnp.sum(weight.reshape((4,) + (1,) * (block.ndim - 1)) * block, axis=0)
        return block

    def jet(self, u: Ray) -> Jet:
        """Exact derivatives of the spline, axis by axis."""
        block, distances = self._local(u)
        n = len(distances)
        for t, h in zip(distances, self.grid.step, strict=True):
            weights = jnp.stack(cubic_b_spline(t)) / jnp.array([1.0, h, h**2], t.dtype)[:, None]
            # contract the first axis left, append one for the order of the derivative
            block = jnp.sum(block[..., None] * weights.T.reshape(4, *(1,) * (n - 1), 3), axis=0)
        order = np.eye(n, dtype=int)
        gradient = jnp.stack([block[tuple(d)] for d in order])
        hessian = jnp.stack([jnp.stack([block[tuple(a + b)] for b in order]) for a in order])
        return Jet(block[(0,) * n], gradient, hessian, self.frame)

    def spectrum(self) -> Spectrum:
        """`sum_k c_k exp(-2 pi i Omega . u_k) prod_i h_i sinc^4(h_i Omega_i)`."""
        self._refuse_open("spectrum")
        return _SplineSpectrum(self)

    def covariance(self) -> Covariance:
        """`int grad f grad f^T / (4 pi^2 int f^2)` of the spline, exactly, from inner products."""
        self._refuse_open("covariance")
        n, c = len(self.boundary), self.coefficients

        def inner(orders: tuple[tuple[int, int], ...]) -> Array:
            products = [
                _inner_products(size, a, b, kind == "periodic") / h ** (a + b)
                for size, h, (a, b), kind in zip(
                    self.grid.size, self.grid.step, orders, self.boundary, strict=True
                )
            ]
            return jnp.sum(c * _along_axes(c, products))

        e = np.eye(n, dtype=int)
        rows = [
            [inner(tuple(zip(e[i].tolist(), e[j].tolist(), strict=True))) for j in range(n)]
            for i in range(n)
        ]
        power = inner(((0, 0),) * n)
        return Covariance(
            jnp.stack([jnp.stack(r) for r in rows]) / (4.0 * np.pi**2 * power), self.frame
        )

    def _refuse_open(self, portrait: str) -> None:
        if "open" in self.boundary:
            raise Refused(
                f"an open table does not know what lies beyond, which its {portrait} needs"
            )


class _SplineSpectrum(Spectrum):
    """Transform of the coefficients, times that of the B-spline."""

    field: Spline

    @property
    def frame(self) -> Frame:
        """Frame of the field."""
        return self.field.frame

    def at(self, Omega: Frequency) -> ComplexScalar:
        """Closed form."""
        f = self.field
        bell = jnp.prod(jnp.sinc(Omega * jnp.asarray(f.grid.step, Omega.dtype)) ** 4)
        return SampledSpectrum(f.coefficients, f.grid, f.frame).at(Omega) * bell

    def extent(self) -> Extent:
        """Two steps more than the samples."""
        grid = self.field.grid
        sides = zip(grid.extent, grid.step, strict=True)
        return Extent.box(grid.center, [0.5 * e + 2.0 * h for e, h in sides])


@functools.cache
def _fit(n: int, boundary: str) -> np.ndarray:
    """Matrix from n samples to the coefficients of the spline through them."""
    if boundary == "open":
        through = np.zeros((n + 4, n + 4))
        for row in range(2, n + 2):
            through[row, row - 1 : row + 2] = np.array([1.0, 4.0, 1.0]) / 6.0
        # Not a knot: the third derivative does not jump at the two outermost samples of each end.
        knot = np.array([1.0, -4.0, 6.0, -4.0, 1.0])
        for end in (0, 1):
            through[end, end : end + 5] = knot
            through[-1 - end, n - 1 - end : n + 4 - end] = knot
        return np.linalg.inv(through)[:, 2:-2]
    through = (4.0 * np.eye(n) + np.eye(n, k=1) + np.eye(n, k=-1)) / 6.0
    if boundary == "periodic":
        through[0, -1] += 1.0 / 6.0
        through[-1, 0] += 1.0 / 6.0
    return np.linalg.inv(through)


# int beta(t) beta(t - k) dt for k = 0, 1, 2, 3, and the same with one and with both derived.
_PRODUCTS = {
    (0, 0): (np.array([2416.0, 1191.0, 120.0, 1.0]) / 5040.0, 1.0),
    (1, 0): (np.array([0.0, -245.0, -56.0, -1.0]) / 720.0, -1.0),
    (1, 1): (np.array([80.0, -15.0, -24.0, -1.0]) / 120.0, 1.0),
}


@functools.cache
def _inner_products(n: int, a: int, b: int, periodic: bool) -> np.ndarray:
    """`int beta^(a)(t - j) beta^(b)(t - k) dt` for all j, k; without the step's powers."""
    if (a, b) == (0, 1):
        return _inner_products(n, 1, 0, periodic).T
    values, parity = _PRODUCTS[a, b]
    matrix = np.zeros((n, n))
    for k, value in enumerate(values):
        for sign in (1, -1) if k else (1,):
            shifted = np.roll(np.eye(n), sign * k, axis=1) if periodic else np.eye(n, k=sign * k)
            matrix += value * (parity if sign < 0 else 1.0) * shifted
    return matrix


@compiled
def _along_axes(a: Array, matrices: list[Any]) -> Array:
    """Apply one matrix along every axis of `a`."""
    for i, matrix in enumerate(matrices):
        a = jnp.moveaxis(jnp.tensordot(jnp.asarray(matrix, a.dtype), a, axes=(1, i)), 0, i)
    return a
