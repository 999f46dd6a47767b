"""A smooth interface between two media: Fresnel reflection and refraction.

Everything here is in the frame of the interface's normal; a curved one stands between
`Curvature(kappa)` and `Curvature(kappa, back=True)`. `eta = n_after / n_before`: the index of the
medium the light goes into (or is reflected by) over that of the medium it comes from.
"""

import abc

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from firstorder._argument_checks import check_between, check_one, check_positive, nan_unless
from firstorder.conventions import FLATLAND, Frame
from firstorder.fields.field import Affine, Field
from firstorder.fields.kernel import Kernel
from firstorder.fields.spectrum import Grid
from firstorder.laws.base import Law
from firstorder.laws.warp import Map, Warp
from firstorder.transport.event import Chain, Event, require_frame
from firstorder.transport.events.mirror import Mirror
from firstorder.transport.events.separable import Angular, AngularFactor, separable
from firstorder.typing import Ray, Scalar, as_float

_HORIZON = 0.5 * np.pi


def _dielectric(eta, c):
    """Fresnel reflectance as a function of `c = cos theta`, with two derivatives.

    With `g = sqrt(eta^2 - 1 + c^2) = eta cos(theta_t)`, `r_s = (c - g) / (c + g)` and
    `r_p = (eta^2 c - g) / (eta^2 c + g)`, `R = (r_s^2 + r_p^2) / 2`. As `dg/dc = c / g`, the
    derivatives are short: `r_s' = -2 r_s / g`, `r_p' = 2 a (a - 1) / (g D^2)`, `a = eta^2`,
    `D = a c + g`. Analytic beyond the horizon (c < 0), where the clamped reflectance is 1.
    """
    a = eta**2
    square = a - 1.0 + c**2
    total = square <= 0  # total reflection: no transmitted ray, so no g
    g = jnp.sqrt(jnp.where(total, 1.0, square))
    # Of two media of one index nothing is reflected; c + g may vanish only there, at the horizon
    # and below. Above it the formulas hold, and with them what changes with the index.
    same = (a == 1.0) & (c <= 0.0)
    sum_s, D = jnp.where(same, 1.0, c + g), jnp.where(same, 1.0, a * c + g)
    s = jnp.where(same, 0.0, (c - g) / sum_s)
    p = jnp.where(same, 0.0, (a * c - g) / D)
    ds, dp = -2.0 * s / g, 2.0 * a * (a - 1.0) / (g * D**2)
    dds = 2.0 * s * (2.0 + c / g) / g**2
    ddp = -dp * (c / g**2 + 2.0 * (a + c / g) / D)
    R = 0.5 * (s**2 + p**2)
    first = s * ds + p * dp
    second = ds**2 + s * dds + dp**2 + p * ddp
    return jnp.where(total, 1.0, R), jnp.where(total, 0.0, first), jnp.where(total, 0.0, second)


def _last_angle(ratio):
    """`arcsin(ratio)`, or grazing if the ratio is 1 or more: the last angle that is refracted."""
    inside = ratio < 1.0
    return jnp.where(inside, jnp.arcsin(jnp.where(inside, ratio, 0.0)), _HORIZON)


def _along_angle(function_of_cosine, t):
    """Chain rule from the cosine to the angle."""
    c, s = jnp.cos(t), jnp.sin(t)
    R, first, second = function_of_cosine(c)
    return R, -s * first, s**2 * second - c * first


class _Extension(Angular):
    """`weight (R(theta) - 1)`, analytic through the horizon: what changes there."""

    eta: Scalar
    weight: Scalar
    axis: str = eqx.field(static=True)
    frame: Frame = eqx.field(static=True)
    periodic: bool = eqx.field(static=True, default=False)

    def derivatives(self, t: Scalar) -> tuple[Scalar, Scalar, Scalar]:
        """The formula, below the horizon too."""
        R, d, dd = _along_angle(lambda c: _dielectric(self.eta, c), t)
        return self.weight * (R - 1.0), self.weight * d, self.weight * dd


class _Nothing(Angular):
    """Zero: a break that is only there for quadrature to split at."""

    axis: str = eqx.field(static=True)
    frame: Frame = eqx.field(static=True)
    periodic: bool = eqx.field(static=True, default=False)

    def derivatives(self, t: Scalar) -> tuple[Scalar, Scalar, Scalar]:
        """Zeros."""
        return 0.0 * t, 0.0 * t, 0.0 * t


class _Dielectric(Angular):
    """`offset + scale R(theta)`, R clamped to 1 below the horizon."""

    eta: Scalar = eqx.field(converter=as_float)
    axis: str = eqx.field(static=True, default="theta")
    frame: Frame = eqx.field(static=True, default=FLATLAND)
    periodic: bool = eqx.field(static=True, default=False)

    def __check_init__(self):
        """Refuse an index that is not positive."""
        check_positive("eta", self.eta)

    @abc.abstractmethod
    def _affine(self) -> tuple[Scalar, Scalar]:
        """Offset and scale of the reflectance in this function."""

    def derivatives(self, t: Scalar) -> tuple[Scalar, Scalar, Scalar]:
        """Value and two derivatives in the angle."""
        offset, scale = self._affine()
        scale = nan_unless(self.eta > 0, scale)
        R, d, dd = _along_angle(lambda c: _dielectric(self.eta, c), t)
        below = jnp.abs(t) >= _HORIZON
        R, d, dd = jnp.where(below, 1.0, R), jnp.where(below, 0.0, d), jnp.where(below, 0.0, dd)
        return offset + scale * R, scale * d, scale * dd

    def breaks(self) -> "tuple[tuple[Scalar, Angular], ...]":
        """The horizons, and the critical angles if there is total reflection.

        At a critical angle the function is continuous but its slope is infinite on one side:
        quadrature splits there and converges algebraically; the Hessian of an integral whose
        critical angle moves over the light does not exist.
        """
        scale = self._affine()[1]
        critical = _last_angle(self.eta)
        out = []
        for side in (-1.0, 1.0):
            change = _Extension(self.eta, -side * scale, self.axis, self.frame)
            out.append((jnp.asarray(side * _HORIZON), change))
            out.append((side * critical, _Nothing(self.axis, self.frame)))
        return tuple(out)


class Fresnel(_Dielectric):
    """Reflectance of a dielectric for unpolarised light, `R = (r_s^2 + r_p^2) / 2`.

    With `c = cos theta` and `g = sqrt(eta^2 - 1 + c^2)`: `r_s = (c - g) / (c + g)`,
    `r_p = (eta^2 c - g) / (eta^2 c + g)`. Total reflection, R = 1, where `sin theta > eta`.
    `1 - R` is the fraction of the power that passes.

    Args:
        eta: index of the medium behind the interface over that in front; positive.
        axis: name of the angle.
        frame: names of all coordinates.
        periodic: on the circle instead of the line.

    Raises:
        ValueError: if `eta` is not positive.

    Reference: the Fresnel term of D05 §4.3 and Fig. 12.

    Example:
        >>> from firstorder.transport import Fresnel
        >>> round(Fresnel(1.5)(0.0, 0.0).item(), 12)  # ((1.5 - 1) / (1.5 + 1))^2
        0.04
    """

    def _affine(self) -> tuple[Scalar, Scalar]:
        return jnp.zeros_like(self.eta), jnp.ones_like(self.eta)


class Transmission(_Dielectric):
    """Factor of the radiance that passes an interface in flatland, `eta (1 - R(theta))`.

    Power is kept: `L_t cos(theta_t) d theta_t = (1 - R) L cos(theta) d theta`, and Snell's law
    `sin theta = eta sin theta_t` makes the ratio of the measures eta. (In space a solid angle is
    squeezed twice, and the factor is `eta^2 (1 - R)`.)

    Args:
        eta: index behind the interface over that in front; positive.
        axis: name of the angle.
        frame: names of all coordinates.
        periodic: on the circle instead of the line.

    Raises:
        ValueError: if `eta` is not positive.

    Example:
        >>> from firstorder.transport import Transmission
        >>> round(Transmission(1.5)(0.0, 0.0).item(), 12)  # 1.5 (1 - 0.04)
        1.44
    """

    def _affine(self) -> tuple[Scalar, Scalar]:
        return self.eta, -self.eta


class Schlick(Angular):
    """Schlick's approximation of the reflectance, `R0 + (1 - R0) (1 - cos theta)^5`.

    Exact at normal and at grazing incidence. In between it is off by up to 0.036 for glass
    (eta = 1.5) and 0.07 for eta in [1.3, 2] (measured), and it knows no total reflection.

    Args:
        R0: reflectance at normal incidence, in [0, 1]; a dielectric's is
            `((eta - 1) / (eta + 1))^2`.
        axis: name of the angle.
        frame: names of all coordinates.
        periodic: on the circle instead of the line.

    Raises:
        ValueError: if `R0` lies outside [0, 1].

    Example:
        >>> from firstorder.transport import Schlick
        >>> round(Schlick(0.04)(0.0, 0.0).item(), 12)
        0.04
    """

    R0: Scalar = eqx.field(converter=as_float)
    axis: str = eqx.field(static=True, default="theta")
    frame: Frame = eqx.field(static=True, default=FLATLAND)
    periodic: bool = eqx.field(static=True, default=False)

    def __check_init__(self):
        """Refuse what is no reflectance."""
        check_between("R0", self.R0, 0.0, 1.0)

    def derivatives(self, t: Scalar) -> tuple[Scalar, Scalar, Scalar]:
        """Value and two derivatives in the angle; 1 below the horizon."""
        R, d, dd = _along_angle(self._of_cosine, t)
        below, valid = jnp.abs(t) >= _HORIZON, (self.R0 >= 0) & (self.R0 <= 1)
        clamped = jnp.where(below, 1.0, R), jnp.where(below, 0.0, d), jnp.where(below, 0.0, dd)
        R, d, dd = (nan_unless(valid, f) for f in clamped)
        return R, d, dd

    def _of_cosine(self, c):
        h, rest = 1.0 - c, 1.0 - self.R0
        return self.R0 + rest * h**5, -5.0 * rest * h**4, 20.0 * rest * h**3

    def breaks(self) -> "tuple[tuple[Scalar, Angular], ...]":
        """The horizons, where the fifth power is cut off with a kink."""
        horizon = jnp.asarray(_HORIZON)
        return tuple(
            (s * horizon, _SchlickExtension(self.R0, -s, self.axis, self.frame))
            for s in (-1.0, 1.0)
        )


class _SchlickExtension(Angular):
    """`sign (R(theta) - 1)` with the polynomial below the horizon too."""

    R0: Scalar
    sign: float
    axis: str = eqx.field(static=True)
    frame: Frame = eqx.field(static=True)
    periodic: bool = eqx.field(static=True, default=False)

    def derivatives(self, t: Scalar) -> tuple[Scalar, Scalar, Scalar]:
        """The polynomial less one."""
        R, d, dd = _along_angle(Schlick(self.R0)._of_cosine, t)
        return self.sign * (R - 1.0), self.sign * d, self.sign * dd


class Snell(Event):
    """Light labelled by its angle behind the interface: `l'(x, theta) = l(x, theta_1(theta))`.

    Snell's law, `sin theta_1 = eta sin theta`: a warp of the angle alone. It relabels and does not
    scale: `refraction` is the whole step. Beyond the last angle that any ray can have behind
    the interface, the map goes on with slope 1 into angles that `Transmission` has made dark. The
    linearisation at a ray scales the angle by `eta cos(theta) / cos(theta_1)`.

    Args:
        eta: index of the medium the light goes into over that of the one it comes from.

    Raises:
        ValueError: if `eta` is not positive.

    Example:
        >>> from firstorder.fields import gaussian
        >>> from firstorder.transport import Snell
        >>> L = gaussian((0.0, 0.0), (1.0, 1.0))
        >>> Snell(1.0)(L)(0.2, 0.3).item() == L(0.2, 0.3).item()
        True
    """

    eta: Scalar = eqx.field(converter=as_float)

    def __check_init__(self):
        """Refuse an index that is not positive."""
        check_positive("eta", self.eta)

    def law(self, frame: Frame) -> Law:
        """The warp."""
        fits = frame.dims == 2 and frame.directions == (1,) and not frame.uses_slopes
        require_frame(fits, self, frame, "a position and an angle")
        check_one("eta", self.eta)
        return Warp(_Refract(self.eta))


class _Refract(Map):
    """`(x, arcsin(eta sin theta))`, continued with slope 1."""

    eta: Scalar

    def _inside(self, t):
        return (jnp.abs(self.eta * jnp.sin(t)) < 1.0) & (jnp.abs(t) < _HORIZON)

    def __call__(self, u: Ray) -> Ray:
        """The ray in front of the interface."""
        x, t = u
        inside = self._inside(t)
        angle = jnp.arcsin(jnp.where(inside, self.eta * jnp.sin(t), 0.0))
        last, first = _last_angle(1.0 / self.eta), _last_angle(self.eta)
        beyond = jnp.sign(t) * (first + jnp.abs(t) - last)
        behind = nan_unless(self.eta > 0, jnp.where(inside, angle, beyond))
        return jnp.stack([x, behind])

    def derivatives(self, u: Ray):
        """`eta cos(theta) / cos(theta_1)` and `eta (eta^2 - 1) sin(theta) / cos(theta_1)^3`."""
        inside = self._inside(u[1])
        s, c = jnp.sin(u[1]), jnp.cos(u[1])
        c1 = jnp.sqrt(jnp.where(inside, 1.0 - (self.eta * s) ** 2, 1.0))
        first = jnp.where(inside, self.eta * c / c1, 1.0)
        bend = jnp.where(inside, self.eta * (self.eta**2 - 1.0) * s / c1**3, 0.0)
        J = jnp.eye(2, dtype=u.dtype).at[1, 1].set(first)
        return self(u), J, jnp.zeros((2, 2, 2), u.dtype).at[1, 1, 1].set(bend)

    def folds(self, frame: Frame) -> tuple[Field, ...]:
        """The last angles on either side, where the continuation begins."""
        last = _last_angle(1.0 / self.eta)
        return tuple(Affine([0.0, 1.0], -side * last, frame) for side in (-1.0, 1.0))


def refraction(eta, frame: Frame = FLATLAND, window: Grid | None = None) -> Chain:
    """Light through an interface: `l'(x, theta) = eta (1 - R(theta_1)) l(x, theta_1)`.

    Here `sin theta_1 = eta sin theta`, Snell's law.

    Radiance over index is kept in flatland (over its square in space), but for what is reflected.

    Args:
        eta: index of the medium the light goes into over that of the one it comes from.
        frame: names of the coordinates.
        window: box for the spectrum of the transmission (see `Multiply`).

    Raises:
        ValueError: if `eta` is not positive.

    Example:
        >>> from firstorder.fields import Constant
        >>> from firstorder.transport import refraction
        >>> into_glass, out = refraction(1.5), refraction(1 / 1.5)
        >>> sky = into_glass(Constant(1.0))
        >>> round(sky(0.0, 0.0).item(), 6), sky(0.0, 0.9).item()  # dark beyond 41.8 degrees
        (1.44, 0.0)
    """
    return AngularFactor(Transmission(eta, frame=frame), window) >> Snell(eta)


def fresnel_reflection(
    eta, lobe: Kernel | None = None, frame: Frame = FLATLAND, window: Grid | None = None
) -> Chain:
    """Light reflected by an interface: the Fresnel term, then a mirror or a rough lobe.

    Args:
        eta: index of the medium behind the interface over that in front.
        lobe: roughness, a kernel of the angle from the mirror direction; a mirror if left out.
        frame: names of the coordinates.
        window: box for the spectrum of the Fresnel term (see `Multiply`).

    Raises:
        ValueError: if `eta` is not positive.

    Example:
        >>> from firstorder.fields import Constant
        >>> from firstorder.transport import fresnel_reflection
        >>> round(fresnel_reflection(1.5)(Constant(1.0))(0.0, 0.0).item(), 12)
        0.04
    """
    term: Field = Fresnel(eta, frame=frame)
    if lobe is None:
        return AngularFactor(term, window) >> Mirror()
    return separable(lobe, incoming=term, window=window)
