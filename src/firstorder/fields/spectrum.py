"""The spectrum portrait: Fourier transform of a field at any frequency.

`F(Omega) = int f(u) exp(-2 pi i Omega . u) du`, cycles per unit (conventions, Fourier).
"""

import abc
from typing import TYPE_CHECKING, Any, Literal, overload

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from firstorder._argument_checks import check_finite, check_integer, check_positive, check_shape
from firstorder._display import Axes, Module, drawn, in_notebook_with_picture
from firstorder.conventions import Frame, fourier_kernel
from firstorder.errors import Refused
from firstorder.fields._held import Held
from firstorder.fields._ray import plain_row, stack
from firstorder.fields.extent import Extent
from firstorder.numerics._batching import batched
from firstorder.numerics._refinement import Approximation, approximated, finer, refined
from firstorder.typing import ComplexScalar, Frequency

if TYPE_CHECKING:
    from firstorder.fields.field import Field


class Spectrum(Held):
    """A complex function of the frequencies that belong to the coordinates of `frame`.

    Example:
        >>> from firstorder.fields import gaussian
        >>> F = gaussian(center=(0.0, 0.0), sigma=(1.0, 1.0)).spectrum()
        >>> round(float(F(0.0, 0.0).real), 6)  # the integral, 2 pi
        6.283185
    """

    frame: eqx.AbstractVar[Frame]

    _repr_markdown_ = in_notebook_with_picture

    @abc.abstractmethod
    def at(self, Omega: Frequency) -> ComplexScalar:
        """Spectral density at one frequency."""

    def extent(self) -> "Extent | None":
        """Extent of the light itself, for windows that must hold it; None if it is not known."""
        return None

    @overload
    def __call__(
        self, *frequencies: Any, with_error: Literal[False] = False
    ) -> Complex[Array, "..."]: ...

    @overload
    def __call__(self, *frequencies: Any, with_error: Literal[True]) -> Approximation: ...

    def __call__(
        self, *frequencies: Any, with_error: bool = False
    ) -> Complex[Array, "..."] | Approximation:
        """Spectral density at broadcast frequencies, in the order of `frame.coordinates`.

        With its error it is an `Approximation`: windows are made larger, with more waves or more
        samples, and rules finer (`Grid.finer`). The error is of the modulus.
        """
        Omega = stack(self.frame, frequencies, type(self).__name__.lstrip("_"))
        if with_error:
            return approximated(lambda step: batched(refined(self, step).at)(Omega))
        return batched(self.at)(Omega)

    def plot(
        self, ax: Axes | None = None, *, window: "Grid | None" = None, decades: float = 6.0
    ) -> Axes:
        r"""Draws the magnitude by powers of ten: over one frequency a curve, over two an image.

        Args:
            ax: matplotlib axes to draw on; new ones if left out, and no window opens.
            window: frequencies at which it is sampled; if left out, those that hold its energy.
            decades: dynamic range; what is fainter is drawn as faint as the range ends.

        Returns:
            The axes.

        Raises:
            ValueError: if the spectrum has more than two coordinates, holds no numbers or has no
                value in the window.

        Example:
            >>> from firstorder.fields import gaussian
            >>> F = gaussian(center=(0.0, 0.0), sigma=(1.0, 0.2)).spectrum()
            >>> F.plot().get_xlabel()
            '$\\Omega_{x}$ (cycles/m)'
        """
        return drawn(self, ax, window=window, decades=decades)

    def __add__(self, other: "Spectrum") -> "SumSpectrum":
        """Superposition."""
        if not isinstance(other, Spectrum):
            return NotImplemented
        return SumSpectrum((self, other), jnp.ones(2))


class SumSpectrum(Spectrum):
    """Weighted sum of spectra.

    Args:
        spectra: m of them, over one frame.
        weights: one number for each.

    Raises:
        ValueError: if the spectra do not share one frame.

    Example:
        >>> from firstorder.fields import SumSpectrum, gaussian
        >>> import jax.numpy as jnp
        >>> F = gaussian((0.0, 0.0), (1.0, 1.0)).spectrum()
        >>> total = SumSpectrum((F, F), jnp.array([1.0, 2.0]))
        >>> (total(0.0, 0.1) / F(0.0, 0.1)).real.round(9).item()
        3.0
    """

    spectra: tuple[Spectrum, ...]
    weights: Float[Array, " m"]

    def __check_init__(self):
        """Refuse a sum over different coordinates."""
        frames = {F.frame for F in self.spectra if not F.frame.implied}
        if len(frames) > 1 or len({F.frame.dims for F in self.spectra}) > 1:
            raise ValueError(
                "Argument `spectra` must share one frame, but are over "
                f"{' and '.join(str(F.frame.coordinates) for F in self.spectra)}."
            )

    @property
    def frame(self) -> Frame:
        """The common frame."""
        return self.spectra[0].frame

    def at(self, Omega: Frequency) -> ComplexScalar:
        """Weighted sum."""
        terms = [w * F.at(Omega) for w, F in zip(self.weights, self.spectra, strict=True)]
        return jnp.sum(jnp.stack(terms), axis=0)

    def extent(self) -> "Extent | None":
        """Extent of the sum; None if that of any term is not known."""
        extents = [F.extent() for F in self.spectra]
        total = extents[0]
        for extent in extents[1:]:
            total = None if total is None or extent is None else total + extent
        return total


class Grid(Module):
    """Regular samples: `size[i]` points of spacing `step[i]` about `center[i]`, even or odd.

    As the `window` of a spectrum a grid is a box and a count: the box must hold the light along
    every coordinate that the factor depends on, and `size[i]` is the number of waves kept along
    that coordinate (see `Multiply`). Along a coordinate that the factor ignores, 1 is right.

    Sample k of an axis lies at `center + (k - (size - 1) / 2) * step`: symmetric for every size,
    the one place where a grid's origin is written. No sample sits at the centre of an even grid.

    Args:
        size: how many samples along each coordinate.
        step: between them [units of the coordinates].
        center: of the grid, the origin if left out [units of the coordinates].

    Raises:
        ValueError: if a size or a step is not positive, not each coordinate has its own, or one is
            traced: a grid is a part of programs, and says how large their arrays are.
        TypeError: if one is no row of numbers.

    Example:
        >>> from firstorder.fields import Grid
        >>> Grid((4, 5), (0.5, 1.0)).axis(0).tolist()
        [-0.75, -0.25, 0.25, 0.75]
    """

    size: tuple[int, ...] = eqx.field(static=True, converter=plain_row("size"))
    step: tuple[float, ...] = eqx.field(static=True, converter=plain_row("step"))
    center: tuple[float, ...] = eqx.field(static=True, default=(), converter=plain_row("center"))

    def __check_init__(self):
        """Fill in the centre at the origin; refuse empty grids and steps that are not positive."""
        if not self.center:
            object.__setattr__(self, "center", (0.0,) * len(self.size))
        for count in self.size:
            check_integer("size", count)
        if not self.size or min(self.size) < 1:
            raise ValueError(f"Argument `size` must hold at least one sample, but is {self.size}.")
        for name, value in (("step", self.step), ("center", self.center)):
            if len(value) != len(self.size):
                n = len(self.size)
                raise ValueError(f"Argument `{name}` must have {n} entries, but has {len(value)}.")
        for step in self.step:
            check_positive("step", step)
        check_finite("center", self.center)

    @classmethod
    def spanning(cls, size: tuple[int, ...], half_width: tuple[float, ...], center=()) -> "Grid":
        """Cells of equal width that fill `center +- half_width`.

        Example:
            >>> from firstorder.fields import Grid
            >>> Grid.spanning((4,), (1.0,)).axis(0).tolist()
            [-0.75, -0.25, 0.25, 0.75]
        """
        return cls(size, tuple(2.0 * w / s for w, s in zip(half_width, size, strict=True)), center)

    def finer(self, step: int) -> "Grid":
        """The grid after a refinement: the box doubled after one, the samples closer after two.

        Twice as many samples on twice the box show what sticks out of this one; three times as many
        and one in this box show what they miss. An axis of one sample stays: nothing varies there.

        Args:
            step: of refinement; 0 is the grid itself.

        Example:
            >>> from firstorder.fields import Grid
            >>> [Grid((4,), (0.5,)).finer(step).extent for step in (0, 1, 2)]
            [(2.0,), (4.0,), (2.0,)]
        """
        wide = step == 1
        size = tuple(n if n == 1 else 2 * n if wide else finer(n, step) for n in self.size)
        steps = tuple(
            h if wide else h * (n / more)
            for h, n, more in zip(self.step, self.size, size, strict=True)
        )
        return type(self)(size, steps, self.center)

    @property
    def extent(self) -> tuple[Any, ...]:
        """Length of each axis, one period of its discrete transform."""
        return tuple(n * h for n, h in zip(self.size, self.step, strict=True))

    @property
    def cell(self) -> float:
        """Volume of one cell."""
        return float(np.prod(self.step))

    def moved(self, M: Array, c: Array) -> "Grid":
        """Grid of as many samples on the smallest upright box around the image under `M u + c`.

        `M` and `c` may be traced; the box's steps then are, too (see `_MovedGrid`).
        """
        center = M @ jnp.asarray(self.center, M.dtype) + c
        extent = jnp.abs(M) @ jnp.asarray(self.extent, M.dtype)
        # A matrix that is not square keeps the largest count for every new axis.
        size = self.size if M.shape[0] == M.shape[1] else (max(self.size),) * M.shape[0]
        return _MovedGrid(
            size, tuple(e / n for e, n in zip(extent, size, strict=True)), tuple(center)
        )

    def axis(self, i: int) -> np.ndarray | Array:
        """Sample positions along axis `i`."""
        return self.center[i] + (np.arange(self.size[i]) - 0.5 * (self.size[i] - 1)) * self.step[i]

    def frequencies(self, i: int) -> np.ndarray | Array:
        """Frequencies of the discrete transform along axis `i`, in increasing order."""
        return np.fft.fftshift(np.fft.fftfreq(self.size[i])) / self.step[i]

    def points(self) -> np.ndarray | Array:
        """All sample rays, shape (*size, n)."""
        return np.stack(np.meshgrid(*map(self.axis, range(len(self.size))), indexing="ij"), -1)

    def sample(self, field: "Field") -> Float[Array, "..."]:
        """Values of a field at all samples, shape `size`."""
        return field(*np.moveaxis(self.points(), -1, 0))


class _MovedGrid(Grid):
    """A grid whose place may be traced: where a moved factor is expanded in its own coordinates."""

    # Arrays and no static numbers: a depth that is differentiated moves the box.
    step: tuple[Array, ...]  # pyright: ignore[reportGeneralTypeIssues]
    center: tuple[Array, ...]  # pyright: ignore[reportGeneralTypeIssues]

    def points(self) -> Array:
        """All sample rays, shape (*size, n)."""
        return jnp.stack(jnp.meshgrid(*map(self.axis, range(len(self.size))), indexing="ij"), -1)

    def sample(self, field: "Field") -> Float[Array, "..."]:
        """Values of a field at all samples, shape `size`."""
        return field(*jnp.moveaxis(self.points(), -1, 0))


def discrete_transform(
    samples: Array | np.ndarray, grid: Grid, *frequencies: Array | np.ndarray
) -> Complex[Array, "..."]:
    """Fourier transform of samples on a tensor grid of *arbitrary* frequencies.

    `F(Omega) = cell * sum_u f(u) exp(-2 pi i Omega . u)`, one matrix product per axis, so the
    frequencies need not lie on the grid of the FFT. Spectrally accurate for a field that fits in
    the grid and whose spectrum fits below the Nyquist frequency `1 / (2 step)`.

    Args:
        samples: values on `grid`, shape `grid.size`.
        grid: where the samples lie.
        frequencies: one array per axis, in cycles per unit.

    Returns:
        Transform on the product of the frequency arrays.

    Raises:
        ValueError: if the samples or the frequencies do not fit the grid.

    Reference: R07 eq. 52 and D05 eq. 1, as a sum.

    Example:
        >>> import numpy as np
        >>> from firstorder.conventions import Frame
        >>> from firstorder.fields import Gaussian, Grid, discrete_transform
        >>> grid = Grid.spanning((32,), (6.0,))
        >>> bell = Gaussian([0.0], [[1.0]], frame=Frame(("x",)))
        >>> F = discrete_transform(grid.sample(bell), grid, np.array([0.0, 0.25]))
        >>> bool(np.allclose(F, bell.spectrum()(np.array([0.0, 0.25])), atol=1e-6))
        True
    """
    samples = jnp.asarray(samples)
    check_shape("samples", samples, grid.size)
    if len(frequencies) != len(grid.size):
        raise ValueError(
            f"Argument `frequencies` must be {len(grid.size)} arrays, one for each axis of the "
            f"grid, but are {len(frequencies)}."
        )
    result = samples * grid.cell
    for i, Omega in enumerate(frequencies):
        kernel = fourier_kernel(jnp.asarray(Omega)[:, None, None], grid.axis(i)[None, :, None])
        result = jnp.moveaxis(jnp.tensordot(kernel, result, axes=(1, i)), 0, i)
    return result


class SampledSpectrum(Spectrum):
    """Spectrum of samples at one arbitrary frequency: the discrete transform, as a portrait.

    Args:
        samples: values on the grid, shape `grid.size`.
        grid: where they lie.
        frame: names of the coordinates.
        source: the field that was sampled; asked again where an error is wanted.

    Raises:
        ValueError: if the samples do not fit the grid.
        Refused: if an error is asked for, and there are samples alone.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.fields import Grid, SampledSpectrum
        >>> F = SampledSpectrum(jnp.ones((4, 2)), Grid((4, 2), (0.5, 1.0)))
        >>> F(0.0, 0.0).real.item()  # the integral
        4.0
    """

    samples: Array
    grid: Grid
    frame: Frame = eqx.field(static=True, default=Frame())
    source: "Field | None" = None

    def __check_init__(self):
        """Refuse samples that do not fit the grid."""
        check_shape("samples", self.samples, self.grid.size)

    def extent(self) -> "Extent":
        """The box of the samples."""
        return Extent.box(self.grid.center, [0.5 * e for e in self.grid.extent])

    @classmethod
    def of(cls, field: "Field", grid: Grid) -> "SampledSpectrum":
        """Sample a field and transform it when asked.

        Example:
            >>> from firstorder.fields import Constant, Grid, SampledSpectrum
            >>> SampledSpectrum.of(Constant(3.0), Grid((4, 2), (0.5, 1.0)))(0.0, 0.0).real.item()
            12.0
        """
        return cls(grid.sample(field), grid, field.frame, field)

    def _finer(self, step: int) -> "SampledSpectrum":
        """The spectrum of more samples of the field, on a larger box or closer."""
        if self.source is None:
            raise Refused(
                "samples alone do not tell their spectrum's error: make it by `SampledSpectrum.of`"
            )
        return type(self).of(refined(self.source, step), self.grid.finer(step))

    def at(self, Omega: Frequency) -> ComplexScalar:
        """`cell * sum f exp(-2 pi i Omega . u)`, axis after axis."""
        result = (self.samples * self.grid.cell).astype(jnp.result_type(self.samples, 1j))
        for i in range(len(self.grid.size)):
            kernel = fourier_kernel(Omega[i, None, None], self.grid.axis(i)[:, None])
            result = jnp.tensordot(kernel, result, axes=(0, 0))
        return result
