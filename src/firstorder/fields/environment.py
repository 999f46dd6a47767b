"""Distant and near lights: an environment, and an isotropic source at a distance."""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from firstorder._argument_checks import (
    check_finite,
    check_integer,
    check_positive,
    check_shape,
    nan_unless,
)
from firstorder.conventions import FLATLAND, Frame, _check_frame
from firstorder.errors import Refused
from firstorder.fields._coerce import field_of
from firstorder.fields._series import Series
from firstorder.fields.covariance import Covariance
from firstorder.fields.field import Affine, Edge, Field
from firstorder.fields.jet import Jet
from firstorder.fields.spectrum import Grid, Spectrum
from firstorder.typing import ComplexScalar, Frequency, Ray, Scalar, Vector, as_float

ANGLE = Frame(("theta",))
POSITION = Frame(("x",))


class Harmonics(Field):
    """Light on the circle of directions as a Fourier series.

    `f(theta) = cosines_0 + sum_k cosines_k cos(k theta) + sines_k sin(k theta)`. Its spectrum is
    the transform of one period, `sum_k c_k 2 pi sinc(2 pi Omega - k)`: at `Omega = m / (2 pi)` it
    is `2 pi c_m`.

    Args:
        cosines: K + 1 coefficients, the mean first.
        sines: K + 1 coefficients; the first is ignored.
        frame: the one coordinate.

    Raises:
        ValueError: if both are not rows of one length, or the frame has several coordinates.

    Example:
        >>> from firstorder.fields import Harmonics
        >>> Harmonics([1.0, 0.5], [0.0, 0.0])(0.0).item()
        1.5
    """

    cosines: Float[Array, " k"] = eqx.field(converter=as_float)
    sines: Float[Array, " k"] = eqx.field(converter=as_float)
    frame: Frame = eqx.field(static=True, default=ANGLE)

    def __check_init__(self):
        """Refuse coefficients that do not pair, and more than one coordinate."""
        _check_frame(self.frame)
        if self.frame.dims != 1:
            names = " and ".join(self.frame.coordinates)
            raise ValueError(f"Argument `frame` must have one coordinate, but has {names}.")
        shape = np.shape(self.cosines)
        if len(shape) != 1 or shape == (0,):
            raise ValueError(
                f"Argument `cosines` must be a row of coefficients, but has shape {shape}."
            )
        check_shape("sines", self.sines, shape)
        check_finite("cosines", self.cosines)
        check_finite("sines", self.sines)

    @classmethod
    def of(cls, field: Field, samples: int) -> Harmonics:
        """Series through equidistant samples on the circle, harmonics below the Nyquist limit.

        Args:
            field: light over one angle.
            samples: how many; the error falls faster than any power for smooth light.

        Raises:
            ValueError: if there is no sample.

        Example:
            >>> import jax.numpy as jnp
            >>> from firstorder.conventions import Frame
            >>> from firstorder.fields import Function, Harmonics
            >>> light = Function(lambda theta: 1.0 + 0.5 * jnp.cos(theta), Frame(("theta",)))
            >>> Harmonics.of(light, 5).cosines.round(12).tolist()
            [1.0, 0.5, -0.0]
        """
        check_integer("samples", samples)
        if samples < 1:
            raise ValueError(f"Argument `samples` must be positive, but is {samples}.")
        theta = 2.0 * np.pi * np.arange(samples) / samples
        c = jnp.fft.rfft(field(theta))[: (samples - 1) // 2 + 1] / samples
        twice = jnp.where(jnp.arange(c.size) == 0, 1.0, 2.0)
        return cls(twice * c.real, -twice * c.imag, field.frame)

    @property
    def orders(self) -> np.ndarray:
        """The integers k."""
        return np.arange(self.cosines.size)

    def at(self, u: Ray) -> Scalar:
        """The series."""
        return self._derived(u[0])[0]

    def jet(self, u: Ray) -> Jet:
        """The series, derived term by term."""
        f, first, second = self._derived(u[0])
        return Jet(f, first[None], second[None, None], self.frame)

    def _derived(self, theta: Scalar) -> tuple[Scalar, Scalar, Scalar]:
        """Value and two derivatives."""
        k, a, b = self.orders, self.cosines, self.sines
        c, s = jnp.cos(k * theta), jnp.sin(k * theta)
        return (
            jnp.sum(a * c + b * s),
            jnp.sum(k * (b * c - a * s)),
            -jnp.sum(k**2 * (a * c + b * s)),
        )

    @property
    def coefficients(self) -> tuple[np.ndarray, Array]:
        """Integers -K ... K and the coefficients of `exp(i k theta)`."""
        c = 0.5 * (self.cosines - 1j * self.sines)[1:]
        k = self.orders[1:]
        mean = self.cosines[:1].astype(c.dtype)
        return np.concatenate([-k[::-1], [0], k]), jnp.concatenate([c[::-1].conj(), mean, c])

    def series(self, window: Grid) -> Series:
        """The series itself, whatever the window."""
        k, c = self.coefficients
        return Series(jnp.asarray(k, self.cosines.dtype)[:, None] / (2.0 * np.pi), c)

    def spectrum(self) -> Spectrum:
        """The transform of one period about 0."""
        return _HarmonicsSpectrum(self)

    def covariance(self) -> Covariance:
        """`sum k^2 |c_k|^2 / (4 pi^2 sum |c_k|^2)`."""
        k, c = self.coefficients
        power = jnp.abs(c) ** 2
        return Covariance(
            jnp.sum((k / (2.0 * np.pi)) ** 2 * power).reshape(1, 1) / jnp.sum(power), self.frame
        )


class _HarmonicsSpectrum(Spectrum):
    """`int f exp(-2 pi i Omega theta)` over one period."""

    light: Harmonics

    @property
    def frame(self) -> Frame:
        """Frame of the light."""
        return self.light.frame

    def at(self, Omega: Frequency) -> ComplexScalar:
        """`sum_k c_k 2 pi sinc(2 pi Omega - k)`."""
        k, c = self.light.coefficients
        return jnp.sum(c * 2.0 * np.pi * jnp.sinc(2.0 * np.pi * Omega[0] - k))


class Environment(Field):
    """Distant light: any function of direction, the same at every position.

    Its spectrum is a Dirac in Omega_x and refuses; as a factor of light that dies out it has one,
    `Multiply(environment, window)(light.spectrum())`, through `series`. Covariance: no energy off
    Omega_x = 0.

    Args:
        light: field over one direction coordinate, such as `Harmonics`, a `Gaussian` or a
            `Function`; a plain function is one of theta.
        frame: the coordinates of the light field.

    Raises:
        ValueError: if `light` is not a function of one direction of `frame`.

    Reference: R07 §3 ("distant lighting").

    Example:
        >>> from firstorder.fields import Environment, Harmonics
        >>> sky = Environment(Harmonics([1.0, 0.5], [0.0, 0.0]))
        >>> sky(3.0, 0.0).item() == sky(-7.0, 0.0).item()
        True
    """

    light: Field = eqx.field(converter=field_of("light", ANGLE))
    frame: Frame = eqx.field(static=True, default=FLATLAND)

    def __check_init__(self):
        """Refuse light that is no function of one direction."""
        names = self.light.frame.coordinates
        directions = tuple(self.frame.coordinates[i] for i in self.frame.directions)
        if len(names) != 1 or names[0] not in directions:
            raise ValueError(
                f"Argument `light` must depend on one of {directions}, not on {names}."
            )

    @property
    def axis(self) -> int:
        """Position in the frame of the direction on which the light depends."""
        return self.frame.axis(self.light.frame.coordinates[0])

    def at(self, u: Ray) -> Scalar:
        """Radiance from that direction."""
        return self.light.at(u[self.axis][None])

    def jet(self, u: Ray) -> Jet:
        """Derivatives along the direction, zeros elsewhere."""
        a = self.axis
        j = self.light.jet(u[a][None])
        zero = jnp.zeros((u.size, u.size), u.dtype)
        gradient = zero[0].at[a].set(j.gradient[0])
        return Jet(j.value, gradient, zero.at[a, a].set(j.hessian[0, 0]), self.frame)

    def edges(self) -> tuple[Edge, ...]:
        """The light's own, at every position."""
        return tuple(
            Edge(self._spread(e.level), Environment(e.jump, self.frame)) for e in self.light.edges()
        )

    def _spread(self, level: Field) -> Field:
        """Level over all coordinates; a straight one stays straight."""
        if isinstance(level, Affine):
            normal = jnp.zeros(self.frame.dims, level.normal.dtype).at[self.axis]
            return Affine(normal.set(level.normal[0]), level.offset, self.frame)
        return Environment(level, self.frame)

    def spectrum(self) -> Spectrum:
        """Refused: it does not die out along x."""
        raise Refused("distant light is a Dirac in Omega_x: window it")

    def series(self, window: Grid) -> Series:
        """The light's own series; no frequency along the positions."""
        a = self.axis
        own = type(window)((window.size[a],), (window.step[a],), (window.center[a],))
        s = self.light.series(own)
        frequencies = jnp.zeros((s.coefficients.size, self.frame.dims), s.frequencies.dtype)
        return Series(frequencies.at[:, a].set(s.frequencies[:, 0]), s.coefficients)

    def covariance(self) -> Covariance:
        """The light's own, on the line of directions."""
        zero = jnp.zeros((self.frame.dims, self.frame.dims))
        own = self.light.covariance().matrix[0, 0]
        return Covariance(zero.at[self.axis, self.axis].set(own), self.frame)


class NearLight(Field):
    """Incoming light of an isotropic source at a distance: a function of the miss distance.

    `L = emission(q)` with the signed distance q from the source's centre p to the ray's line,
    `q = (x - p_x) cos(theta) - p_y sin(theta)`. A disk that shines evenly is a box for an emission;
    a soft ball a Gaussian. For a ray that points away from the source q goes on growing in
    magnitude, to twice the distance, so it never shines from behind.

    Valid when: the receiver lies outside the emission. In the limit of a distant source
    this is an `Environment`.

    Args:
        center: where the source is, (p_x, p_y) in metres, p_y > 0.
        emission: field over one coordinate, in metres, or a plain function of it.
        frame: incoming light in angles or slopes.

    Raises:
        ValueError: if the source is not above the receiver.

    Example:
        >>> from firstorder.fields import Gaussian, NearLight
        >>> from firstorder.conventions import Frame
        >>> ball = Gaussian([0.0], [[100.0]], frame=Frame(("x",)))
        >>> NearLight([0.0, 2.0], ball)(0.0, 0.0).item()
        1.0
    """

    center: Vector = eqx.field(converter=as_float)
    emission: Field = eqx.field(converter=field_of("emission", POSITION))
    frame: Frame = eqx.field(static=True, default=FLATLAND)

    def __check_init__(self):
        """Refuse a source in or below the surface."""
        check_shape("center", self.center, (2,))
        check_finite("center", self.center)
        check_positive("center[1]", self.center[1])
        if self.emission.frame.dims != 1:
            n = self.emission.frame.dims
            raise ValueError(f"Argument `emission` must have one coordinate, but has {n}.")
        if self.frame.dims != 2 or self.frame.sense != "incoming":
            raise ValueError(
                "Argument `frame` must be that of incoming flatland light, but is "
                f"{self.frame.sense} in {self.frame.coordinates}."
            )

    def at(self, u: Ray) -> Scalar:
        """Emission at the miss distance."""
        return self.emission.at(self._miss(u)[0][None])

    def jet(self, u: Ray) -> Jet:
        """Chain rule through the miss distance."""
        q, g, H = self._miss(u)
        j = self.emission.jet(q[None])
        first, second = jnp.squeeze(j.gradient), jnp.squeeze(j.hessian)
        return Jet(j.value, first * g, second * g[:, None] * g + first * H, self.frame)

    def edges(self) -> tuple[Edge, ...]:
        """The emission's own, seen from everywhere."""
        return tuple(
            Edge(
                NearLight(self.center, e.level, self.frame),
                NearLight(self.center, e.jump, self.frame),
            )
            for e in self.emission.edges()
        )

    def spectrum(self) -> Spectrum:
        """Refused: perspective is a warp."""
        raise Refused("near light is a warp of its emission, without a simple Fourier formula")

    def _miss(self, u: Ray) -> tuple[Scalar, Vector, Array]:
        """The miss distance q with its gradient and Hessian."""
        x, height = u[0] - self.center[0], nan_unless(self.center[1] > 0, self.center[1])
        zero = jnp.zeros_like(x)
        if self.frame.uses_slopes:
            c = 1.0 / jnp.sqrt(1.0 + u[1] ** 2)  # the cosine, and its derivatives by slope
            d, dd = -u[1] * c**3, (2.0 * u[1] ** 2 - 1.0) * c**5
            s = x - u[1] * height
            q, along = s * c, (height + u[1] * x) * c
            g = jnp.stack([c, s * d - height * c])
            H = [[zero, d], [d, s * dd - 2.0 * height * d]]
        else:
            c, s = jnp.cos(u[1]), jnp.sin(u[1])
            q, along = x * c - height * s, height * c + x * s
            g = jnp.stack([c, -x * s - height * c])
            H = [[zero, -s], [-s, -q]]
        H = jnp.stack([jnp.stack(row) for row in H])
        # Behind: q = +-2 R - q, with the distance R from the source, which depends on x alone.
        R = jnp.sqrt(x**2 + height**2)
        side = jnp.where(q < 0.0, -2.0, 2.0)
        away = (
            side * R - q,
            side * jnp.stack([x / R, zero]) - g,
            side * jnp.zeros((2, 2), q.dtype).at[0, 0].set(height**2 / R**3) - H,
        )
        behind = along < 0.0
        q, g, H = (jnp.where(behind, b, a) for a, b in zip((q, g, H), away, strict=True))
        return q, g, H
