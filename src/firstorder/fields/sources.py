"""Lights: a point, a spot with a finite bulb, a line light at a height (D05 Fig. 4).

A light is an emitter in space times a falloff in direction, one profile per coordinate. All are
given at their own plane; `line_light` carries one to a receiver below.
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array

from firstorder._argument_checks import check_finite, check_positive, check_shape
from firstorder.conventions import UNSTATED_SLOPE, Frame, fourier_kernel
from firstorder.errors import Refused
from firstorder.fields.covariance import Covariance
from firstorder.fields.extent import Extent
from firstorder.fields.field import Affine, Constant, Edge, Field, _relabelled
from firstorder.fields.jet import Jet
from firstorder.fields.kernel import GaussianProfile, Profile
from firstorder.fields.spectrum import Spectrum
from firstorder.numerics._select import either
from firstorder.typing import ComplexScalar, Frequency, Ray, Scalar, Vector, as_float


class DiracProfile(Profile):
    """All the light at one place: no value, but a constant spectrum.

    Args:
        axis: name of the coordinate.
        frame: names of all coordinates; left out, those that `axis` names, or of the light.
        weight: its integral.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.fields import DiracProfile
        >>> DiracProfile("x").transform(jnp.array(7.0)).item()
        1.0
    """

    axis: str = eqx.field(static=True, default="x")
    frame: Frame = eqx.field(static=True, default=UNSTATED_SLOPE)
    weight: Scalar = eqx.field(converter=as_float, default=1.0)

    def __check_init__(self):
        """Refuse an axis that is not there."""
        self._state_frame()

    def half_width(self) -> Scalar:
        """Zero."""
        return 0.0 * self.weight

    def derivatives(self, t: Scalar) -> tuple[Scalar, Scalar, Scalar]:
        """Refused: infinite at one place, zero elsewhere."""
        raise Refused(
            f"a Dirac in {self.axis} has no value: ask for its spectrum, or give it width"
        )

    def transform(self, Omega: Scalar) -> Array:
        """The weight, at every frequency."""
        return self.weight + 0.0 * Omega

    def spread(self) -> Scalar:
        """Refused: a constant spectrum has no second moment."""
        raise Refused(f"a Dirac in {self.axis} has an infinite covariance")


class UniformProfile(Profile):
    """A profile of one value along its axis; its spectrum is a Dirac.

    Args:
        axis: name of the coordinate.
        frame: names of all coordinates; left out, those that `axis` names, or of the light.
        height: the value [unit of radiance].

    Example:
        >>> from firstorder.fields import UniformProfile
        >>> UniformProfile("v", height=2.0)(0.3, 5.0).item()
        2.0
    """

    axis: str = eqx.field(static=True, default="v")
    frame: Frame = eqx.field(static=True, default=UNSTATED_SLOPE)
    height: Scalar = eqx.field(converter=as_float, default=1.0)

    def __check_init__(self):
        """Refuse an axis that is not there."""
        self._state_frame()

    def half_width(self) -> Scalar:
        """Infinite."""
        return jnp.inf + 0.0 * self.height

    def derivatives(self, t: Scalar) -> tuple[Scalar, Scalar, Scalar]:
        """The height and zeros."""
        return self.height + 0.0 * t, 0.0 * t, 0.0 * t

    def transform(self, Omega: Scalar) -> Array:
        """Refused: it does not die out."""
        raise Refused(f"light that is constant in {self.axis} is a Dirac in Omega_{self.axis}: "
                      "window it")  # fmt: skip

    def spread(self) -> Scalar:
        """Zero: all energy lies at zero frequency."""
        return 0.0 * self.height


class BoxProfile(Profile):
    """`height` on `|t| < half_width`, nothing outside: an emitter of finite size.

    Its transform is `2 w height sinc(2 w Omega)`; its two edges are reported.

    Args:
        width: half of its size w, in the unit of the axis.
        axis: name of the coordinate.
        frame: names of all coordinates; left out, those that `axis` names, or of the light.
        height: value inside [unit of radiance].

    Raises:
        ValueError: if `width` is not positive.

    Example:
        >>> from firstorder.fields import BoxProfile
        >>> bulb = BoxProfile(0.5, "x")
        >>> bulb(0.4, 0.0).item(), bulb(0.6, 0.0).item()
        (1.0, 0.0)
    """

    width: Scalar = eqx.field(converter=as_float)
    axis: str = eqx.field(static=True, default="x")
    frame: Frame = eqx.field(static=True, default=UNSTATED_SLOPE)
    height: Scalar = eqx.field(converter=as_float, default=1.0)

    def __check_init__(self):
        """Refuse a box without inside."""
        check_positive("width", self.width)
        self._state_frame()

    def half_width(self) -> Scalar:
        """Half the width of the box; NaN for a traced one without inside."""
        return either(self.width > 0, self.width, jnp.nan)

    def derivatives(self, t: Scalar) -> tuple[Scalar, Scalar, Scalar]:
        """Height and zeros; half the height on an edge."""
        inside = 0.5 * (1.0 + jnp.sign(self.half_width() - jnp.abs(t)))
        return self.height * inside, 0.0 * t, 0.0 * t

    def edges(self) -> tuple[Edge, ...]:
        """Both ends."""
        width = self.half_width()
        normal = jnp.zeros(self.frame.dims, width.dtype)
        normal = normal.at[self.frame.axis(self.axis)].set(1.0)
        up, down = Constant(self.height, self.frame), Constant(-self.height, self.frame)
        return (
            Edge(Affine(normal, width, self.frame), up),
            Edge(Affine(normal, -width, self.frame), down),
        )

    def transform(self, Omega: Scalar) -> Array:
        """`2 w height sinc(2 w Omega)`, with `sinc(z) = sin(pi z) / (pi z)`."""
        width = 2.0 * self.half_width()
        return width * self.height * jnp.sinc(width * Omega)

    def spread(self) -> Scalar:
        """Refused: it has edges."""
        raise Refused("an edge has an infinite covariance: its power falls off as 1 / Omega^2")


class Separable(Field):
    """`prod_i p_i(u_i - center_i)`: one profile per coordinate, in any dimension.

    The spectrum is the product of the profiles' transforms, with a phase for the centre.
    Covariance: diagonal.

    Args:
        center: where the profiles are centred [units of the coordinates].
        factors: one profile for each coordinate, in their order.

    Raises:
        ValueError: if the profiles do not name all coordinates in order.

    Example:
        >>> from firstorder.fields import BoxProfile, GaussianProfile, Separable
        >>> from firstorder.conventions import FLATLAND_SLOPE
        >>> falloff = GaussianProfile(0.2, "v", FLATLAND_SLOPE)
        >>> light = Separable([0.0, 0.0], (BoxProfile(0.5, "x"), falloff))
        >>> light.jets(0.1, 0.0).gradient.tolist()
        [0.0, -0.0]
    """

    center: Vector = eqx.field(converter=as_float)
    factors: tuple[Profile, ...]

    @property
    def frame(self) -> Frame:
        """The profiles' frame."""
        return self.factors[0].frame

    def __check_init__(self):
        """Refuse profiles that do not make a light field."""
        stated = [p.frame for p in self.factors if not p.frame.implied]
        if stated:
            factors = (_relabelled(p, stated[0]) for p in self.factors)
            object.__setattr__(self, "factors", tuple(factors))
        axes = tuple(p.axis for p in self.factors)
        if axes != self.frame.coordinates or any(p.frame != self.frame for p in self.factors):
            raise ValueError(
                f"Argument `factors` must act along {self.frame.coordinates}, but does on {axes}."
            )
        check_shape("center", self.center, (len(axes),))
        check_finite("center", self.center)

    def at(self, u: Ray) -> Scalar:
        """Product of the profiles."""
        return self._product(u)

    def jet(self, u: Ray) -> Jet:
        """Every profile derived in its turn."""
        n = len(self.factors)
        product = self._product
        gradient = [product(u, {i: 1}) for i in range(n)]
        hessian = [
            [product(u, {i: 2} if i == j else {i: 1, j: 1}) for j in range(n)] for i in range(n)
        ]
        rows = jnp.stack([jnp.stack(row) for row in hessian])
        return Jet(product(u), jnp.stack(gradient), rows, self.frame)

    def _product(self, u: Ray, orders: dict[int, int] | None = None) -> Scalar:
        """Product of the profiles, each derived as often as `orders` says."""
        orders, t = orders or {}, jnp.asarray(u) - self.center
        result = jnp.ones((), t.dtype)
        for i, p in enumerate(self.factors):
            result = result * p.derivatives(t[i])[orders.get(i, 0)]
        return result

    def edges(self) -> tuple[Edge, ...]:
        """Edges of the profiles, where the others shine."""
        found = []
        for i, p in enumerate(self.factors):
            for e in p.edges():
                level = e.level
                assert isinstance(level, Affine)  # a profile breaks at places on its axis
                offset = level.offset - jnp.sum(level.normal * self.center)
                height = e.jump.at(self.center)
                others = tuple(
                    UniformProfile(p.axis, p.frame, height) if k == i else q
                    for k, q in enumerate(self.factors)
                )
                moved = Affine(level.normal, offset, self.frame)
                found.append(Edge(moved, Separable(self.center, others)))
        return tuple(found)

    def spectrum(self) -> Spectrum:
        """Product of the transforms."""
        spectrum = _SeparableSpectrum(self)
        # Ask once, abstractly: a profile without a transform refuses now and not when evaluated.
        jax.eval_shape(spectrum.at, self.center)
        return spectrum

    def covariance(self) -> Covariance:
        """Diagonal: odd moments of a real light vanish."""
        return Covariance(jnp.diag(jnp.stack([p.spread() for p in self.factors])), self.frame)


class _SeparableSpectrum(Spectrum):
    """`exp(-2 pi i Omega . center) prod_i P_i(Omega_i)`."""

    light: Separable

    @property
    def frame(self) -> Frame:
        """Frame of the light."""
        return self.light.frame

    def at(self, Omega: Frequency) -> ComplexScalar:
        """Closed form."""
        result = fourier_kernel(Omega, self.light.center)
        for p, w in zip(self.light.factors, Omega, strict=True):
            result = result * p.transform(w)
        return result

    def extent(self) -> Extent:
        """Each profile about the centre: a bell by its width, any other as far as it reaches."""
        bells, boxes = [], []
        for p in self.light.factors:
            bell = type(p) is GaussianProfile
            bells.append(p.sigma**2 if bell else jnp.zeros(()))
            boxes.append(jnp.zeros(()) if bell else p.half_width())
        spread, sides = (jnp.diag(jnp.stack(widths))[None] for widths in (bells, boxes))
        return Extent(self.light.center[None], spread, sides)


def point_light(x, falloff: Profile, weight=1.0) -> Separable:
    """A Dirac in space times a falloff in direction; its spectrum is constant in Omega_x.

    `l(u) = weight delta(u_x - x) falloff(u_v)`. Values and jets refuse. With `UniformProfile` for a
    falloff this is the isotropic point of the paper, whose spectrum is a Dirac in direction, and
    refuses too.

    Args:
        x: where it stands, in metres.
        falloff: profile along the direction coordinate.
        weight: strength.

    Raises:
        ValueError: if `falloff` is no profile of the last of two coordinates, or `x` is not finite.

    Reference: D05 Fig. 4 (a), (b).

    Example:
        >>> from firstorder.conventions import FLATLAND_SLOPE
        >>> from firstorder.fields import GaussianProfile, point_light
        >>> F = point_light(0.0, GaussianProfile(0.3, "v", FLATLAND_SLOPE)).spectrum()
        >>> F(0.0, 0.5).item() == F(123.0, 0.5).item()
        True
    """
    frame = falloff.frame
    return Separable([x, 0.0], (DiracProfile(frame.coordinates[0], frame, weight), falloff))


def spot_light(x, half_width, falloff: Profile) -> Separable:
    """A bulb of finite size with a smooth falloff in direction: a box times a bell.

    Its spectrum is a sinc times the falloff's transform.

    Args:
        x: middle of the bulb, in metres.
        half_width: half of its size, in metres.
        falloff: profile along the direction coordinate.

    Raises:
        ValueError: if `half_width` is not positive.

    Reference: D05 Fig. 4 (c), (d).

    Example:
        >>> from firstorder.conventions import FLATLAND_SLOPE
        >>> from firstorder.fields import GaussianProfile, spot_light
        >>> spot = spot_light(0.0, 0.5, GaussianProfile(0.3, "v", FLATLAND_SLOPE))
        >>> abs(spot.spectrum()(1.0, 0.0).item()) < 1e-7  # the sinc's first zero
        True
    """
    check_positive("half_width", half_width)
    frame = falloff.frame
    return Separable([x, 0.0], (BoxProfile(half_width, frame.coordinates[0], frame), falloff))
