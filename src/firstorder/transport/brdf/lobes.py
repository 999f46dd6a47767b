"""Lobes: functions of one angle difference, their arguments, and profiles.

A lobe is a kernel together with the *argument* it depends on. R07 writes every BRDF as a function
of `2 n - theta - omega`; a diffuse one depends on `n - omega` instead, and turns half as fast with
the normal.
"""

import dataclasses

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax.scipy.special import gammaln
from jaxtyping import Array, Float

from firstorder._argument_checks import (
    check_between,
    check_finite,
    check_kind,
    check_positive,
    is_concrete,
    nan_unless,
)
from firstorder._display import Module
from firstorder.conventions import UNSTATED, Frame, fourier_kernel, frame_with
from firstorder.fields.kernel import GaussianProfile, Kernel, Profile
from firstorder.numerics._select import whole_below
from firstorder.numerics._splines import cubic_b_spline
from firstorder.typing import Scalar, as_float


@dataclasses.dataclass(frozen=True)
class LobeArgument:
    """The angle `turn n(x) + look theta - omega` that a lobe depends on.

    A rigid rotation adds one angle to n, theta and omega and must change nothing, so
    `look = 1 - turn`.

    Attributes:
        turn: how far the lobe turns when the normal turns by one [rad/rad].
        words: the angle, for tables.

    Example:
        >>> from firstorder.transport import LobeArgument
        >>> LobeArgument(2.0, "2 n - theta - omega").look
        -1.0
    """

    turn: float
    words: str

    @property
    def look(self) -> float:
        """Rate at which the lobe turns with the outgoing direction."""
        return 1.0 - self.turn


MIRROR = LobeArgument(2.0, "2 n - theta - omega")
NORMAL = LobeArgument(1.0, "n - omega")
RETRO = LobeArgument(0.0, "theta - omega")


class Lobe(Module):
    """One term of a BRDF: `rho(x, turn n(x) + look theta - omega)`, with or without the cosine.

    Args:
        kernel: a `Profile`, or a `Kernel` that also varies in x.
        argument: `MIRROR` (glossy), `NORMAL` (diffuse) or `RETRO` (back to where it came from).
        cosine: multiply by `cos+(omega - n)`, the clamped cosine of the incoming local angle.

    Raises:
        TypeError: if `kernel` is no kernel, or `argument` no `LobeArgument`.

    Example:
        >>> from firstorder.fields import GaussianProfile
        >>> from firstorder.transport import Lobe
        >>> from firstorder.transport.brdf.lobes import MIRROR
        >>> Lobe(GaussianProfile(0.1), MIRROR).argument.words
        '2 n - theta - omega'
    """

    kernel: Kernel
    argument: LobeArgument = eqx.field(static=True, default=MIRROR)
    cosine: bool = eqx.field(static=True, default=False)

    def __check_init__(self):
        """Refuse what is no kernel, and an angle in words."""
        check_kind("kernel", self.kernel, Kernel, "a kernel, such as GaussianProfile(0.1)")
        check_kind("argument", self.argument, LobeArgument, "MIRROR, NORMAL or RETRO")


class CosinePowerProfile(Profile):
    """`p(t) = weight c_s cos(t)^s` for |t| < pi/2, zero beyond: the Phong lobe in flatland.

    `c_s = Gamma(s/2 + 1) / (sqrt(pi) Gamma((s + 1)/2))` makes the integral `weight`. Its transform
    is `weight Gamma(1 + s/2)^2 / (Gamma(1 + s/2 + pi Omega) Gamma(1 + s/2 - pi Omega))`, from the
    Beta integral of `cos^s t exp(-i a t)`.

    Valid for s >= 1, real: below, p' is not integrable in the square. For s = 1 (the diffuse lobe)
    p' jumps at the ends, for s < 2 p'' is unbounded there; `Surface` never needs either.

    Args:
        s: exponent, at least 1.
        axis: name of the coordinate it acts along.
        frame: names of all coordinates.
        weight: its integral (an albedo).

    Raises:
        ValueError: if `s` is below 1 or not finite, or `weight` is not finite.

    Reference: R07 §4.1 ("Phong-like BRDFs"); derived in derivations/transport/brdf/lobes.py.

    Example:
        >>> import jax.numpy as jnp
        >>> from firstorder.transport import CosinePowerProfile
        >>> round(CosinePowerProfile(1.0).at(jnp.zeros(2)).item(), 12)  # half a cosine
        0.5
    """

    s: Scalar = eqx.field(converter=as_float)
    axis: str = eqx.field(static=True, default="theta")
    frame: Frame = eqx.field(static=True, default=UNSTATED)
    weight: Scalar = eqx.field(converter=as_float, default=1.0)

    def __check_init__(self):
        """Refuse a lobe that is too blunt, or infinite."""
        check_finite("s", self.s)
        check_between("s", self.s, 1.0, np.inf)
        check_finite("weight", self.weight)
        self._state_frame()

    def half_width(self) -> Scalar:
        """pi/2, or where the power has fallen to 1e-18 of its peak."""
        # arccos(exp(-y)) of a small y, of which 1 - exp(-y) is not rounded away.
        y = 18.0 * float(np.log(10.0)) / self.s
        return 2.0 * jnp.arcsin(jnp.sqrt(-0.5 * jnp.expm1(-y)))

    def derivatives(self, t: Scalar) -> tuple[Scalar, Scalar, Scalar]:
        """`c cos^s, -c s cos^(s-1) sin, c s ((s-1) cos^(s-2) sin^2 - cos^s)`."""
        s = nan_unless(self.s >= 1, self.s)
        # The ends belong to the lobe, rounding included: one-sided derivatives are wanted there.
        rounding = 64.0 * float(jnp.finfo(jnp.result_type(t)).eps)
        beyond = jnp.abs(t) > 0.5 * np.pi + rounding
        safe = jnp.where(beyond, 0.0, t)
        tiny = jnp.finfo(jnp.result_type(t)).tiny
        cos, sin = jnp.maximum(jnp.cos(safe), tiny), jnp.sin(safe)
        # A rounded cosine near 1, to a high power, would be far off: its logarithm is not.
        steep = sin**2 > 0.5
        log = jnp.where(steep, jnp.log(cos), 0.5 * jnp.log1p(-jnp.where(steep, 0.0, sin**2)))
        scale = jnp.where(beyond, 0.0, self.weight * _half_step(s) / float(np.sqrt(np.pi)))
        p = jnp.exp(s * log)
        d = -s * jnp.exp((s - 1.0) * log) * sin
        dd = s * ((s - 1.0) * jnp.exp((s - 2.0) * log) * sin**2 - p)
        return scale * p, scale * d, scale * dd

    def transform(self, Omega: Scalar) -> Array:
        """The ratio of Gamma functions; reflected where one argument is negative."""
        top, a = 1.0 + 0.5 * nan_unless(self.s >= 1, self.s), np.pi * jnp.abs(Omega)
        near, large = top - a > 0.5, top - a > _LARGE
        # 1 / Gamma(z) = sin(pi z) Gamma(1 - z) / pi for z = top - a below 1/2
        z = jnp.where(near, 0.25, top - a)
        # Logarithms are added before the exponential: each Gamma alone overflows.
        rest = 2.0 * gammaln(top) - gammaln(top + a)
        far = jnp.sin(np.pi * z) / np.pi * jnp.exp(jnp.where(near, 0.0, rest) + gammaln(1.0 - z))
        close = jnp.exp(jnp.where(near, rest, 0.0) - gammaln(jnp.where(near, top - a, 1.0)))
        sharp = jnp.exp(_log_ratio(jnp.where(large, top, 2.0 * _LARGE), jnp.where(large, a, 0.0)))
        return self.weight * jnp.where(large, sharp, jnp.where(near, close, far))

    def spread(self) -> Scalar:
        """`int p'^2 / (4 pi^2 int p^2) = s^2 / (4 pi^2 (2 s - 1))`; the rule is then not exact."""
        s = nan_unless(self.s >= 1, self.s)
        return s**2 / (4.0 * np.pi**2 * (2.0 * s - 1.0))


class TabulatedProfile(Profile):
    """A measured lobe: the cubic spline through equidistant values, zero two steps beyond them.

    `p(t) = sum_j c_j b((t - t_j) / step)` with the cubic B-spline b, so p is twice continuously
    differentiable everywhere and has no ends. Its transform is
    `step sinc(Omega step)^4 sum_j c_j exp(-2 pi i Omega t_j)`.

    Wrong when the first or last value is far from zero: the spline then falls to zero within two
    steps.

    Args:
        values: at `center + (j - (size - 1) / 2) step`.
        step: distance of the nodes, in the unit of the axis.
        center: middle of the table [unit of the axis].
        weight: what the integral shall be; left out, that of the spline itself.
        axis: name of the coordinate it acts along.
        frame: names of all coordinates.

    Raises:
        ValueError: if there are fewer than two values, one is not finite, `step` is not positive,
            or the integral is not (no lobe can then be normalised).

    Example:
        >>> from firstorder.transport import TabulatedProfile
        >>> lobe = TabulatedProfile([0.0, 1.0, 3.0, 1.0, 0.0], 0.1)
        >>> round(lobe(0.0, 0.1).item(), 12)
        1.0
    """

    coefficients: Float[Array, " k"]
    step: Scalar
    center: Scalar
    axis: str = eqx.field(static=True)
    frame: Frame = eqx.field(static=True)

    def __init__(
        self, values, step, center=0.0, weight=None, axis="theta", frame: Frame = UNSTATED
    ):
        """Solve for the coefficients; see the class."""
        values, step = as_float(values), as_float(step)
        check_finite("values", values)
        check_positive("step", step)
        if values.ndim != 1 or values.size < 2:
            raise ValueError(
                f"Argument `values` must be a list of two or more, but has shape {values.shape}."
            )
        n = values.size
        matrix = (4.0 * np.eye(n) + np.eye(n, k=1) + np.eye(n, k=-1)) / 6.0
        c = jnp.linalg.solve(jnp.asarray(matrix, values.dtype), values)
        integral = step * jnp.sum(c)
        if is_concrete(integral) and not integral > 0:
            raise ValueError(
                f"Argument `values` must have a positive integral, but it is {float(integral)}."
            )
        c = nan_unless((step > 0) & (integral > 0), c)
        self.coefficients = c if weight is None else c * (as_float(weight) / integral)
        self.step, self.center, self.axis, self.frame = (
            step,
            as_float(center),
            axis,
            frame_with(axis, frame),
        )
        self.frame.axis(axis)

    def half_width(self) -> Scalar:
        """Half the table and two steps, from the origin of the axis."""
        n = self.coefficients.size
        return jnp.abs(self.center) + (0.5 * (n - 1) + 2.0) * self.step

    def knots(self) -> Float[Array, " m"]:
        """Points at which one cubic gives way to the next."""
        n = self.coefficients.size
        return self.center + (jnp.arange(-2, n + 2) - 0.5 * (n - 1)) * self.step

    def derivatives(self, t: Scalar) -> tuple[Scalar, Scalar, Scalar]:
        """Four B-splines overlap at every t."""
        n = self.coefficients.size
        s = (t - self.center) / self.step + 0.5 * (n - 1)
        first = whole_below(s).astype(int) - 1
        j = first + jnp.arange(4)
        nothing = 0.0 * self.coefficients[0]  # NaN for traced numbers that make no lobe
        c = jnp.where((j >= 0) & (j < n), self.coefficients[jnp.clip(j, 0, n - 1)], nothing)
        b, d, dd = cubic_b_spline(s - j)
        return jnp.sum(c * b), jnp.sum(c * d) / self.step, jnp.sum(c * dd) / self.step**2

    def transform(self, Omega: Scalar) -> Array:
        """Closed form: a B-spline is four boxes convolved."""
        n = self.coefficients.size
        t = self.center + (jnp.arange(n) - 0.5 * (n - 1)) * self.step
        waves = fourier_kernel(jnp.asarray(Omega)[None, None], t[:, None])
        return self.step * jnp.sinc(Omega * self.step) ** 4 * jnp.sum(self.coefficients * waves)


_LARGE = 20.0


def _log_ratio(z: Scalar, a: Scalar) -> Scalar:
    """`log(Gamma(z)^2 / (Gamma(z + a) Gamma(z - a)))`, with no difference of large logarithms.

    Stirling's series of the three, whose large terms are combined; exact to rounding for
    `z - a > 20`.
    """

    def rest(x):
        y = 1.0 / x**2
        return (1 / 12 + y * (-1 / 360 + y * (1 / 1260 + y * (-1 / 1680 + y / 1188)))) / x

    r = a / z
    large = (z - 0.5) * jnp.log1p(-(r**2)) + 2.0 * a * jnp.arctanh(r)
    return 2.0 * rest(z) - rest(z + a) - rest(z - a) - large


def _half_step(s: Scalar) -> Scalar:
    """`Gamma(s/2 + 1) / Gamma((s + 1)/2)`, with no difference of large logarithms.

    Twelve steps of the recursion lead to an argument where the asymptotic series about the middle,
    `x = s/2 + 1/4`, is exact to rounding: `sqrt(x) exp(1/(64 x^2) - 5/(2048 x^4) + ...)`.
    """
    j = jnp.arange(12, dtype=s.dtype)
    steps = jnp.prod((0.5 * s + j + 0.5) / (0.5 * s + j + 1.0))
    x = 0.5 * s + 12.25
    y = 1.0 / x**2
    series = y * (1 / 64 + y * (-5 / 2048 + y * (61 / 49152 + y * (-1385 / 1048576))))
    return steps * jnp.sqrt(x) * jnp.exp(series + 50521 / 20971520 * y**5)


def glossy(sigma, weight=1.0, cosine: bool = False) -> Lobe:
    """Gaussian lobe about the mirror direction, argument `2 n - theta - omega`.

    Args:
        sigma: standard deviation in radians.
        weight: its integral.
        cosine: multiply by the clamped cosine of the incoming angle.

    Raises:
        ValueError: if `sigma` is not positive.

    Reference: R07 §4.1, step 3.

    Example:
        >>> from firstorder.transport import glossy
        >>> glossy(0.1).kernel.half_width().item()
        0.9
    """
    return Lobe(GaussianProfile(sigma, weight=weight), MIRROR, cosine)


def phong(s, weight=1.0, cosine: bool = False) -> Lobe:
    """`CosinePowerProfile` about the mirror direction, of argument `2 n - theta - omega`.

    Args:
        s: the exponent, at least 1.
        weight: integral of the lobe.
        cosine: whether light is weighed by the cosine of incidence.

    Raises:
        ValueError: if `s` is below 1.

    Example:
        >>> from firstorder.transport import phong
        >>> phong(20.0).argument.words
        '2 n - theta - omega'
    """
    return Lobe(CosinePowerProfile(s, weight=weight), MIRROR, cosine)


def lambert(albedo=1.0) -> Lobe:
    """Lambert's law: `albedo / 2 cos+(omega - n)`, argument `n - omega`.

    The flatland cosine integrates to 2, hence the half. The cosine is in the lobe.

    Args:
        albedo: reflected over incident power, in [0, 1].

    Raises:
        ValueError: if `albedo` lies outside [0, 1].

    Reference: R07 §5.2, which has it smooth wherever the light is.

    Example:
        >>> from firstorder.transport import lambert
        >>> lambert(0.5).argument.words
        'n - omega'
    """
    check_between("albedo", albedo, 0.0, 1.0)
    albedo = as_float(albedo)
    albedo = nan_unless((albedo >= 0) & (albedo <= 1), albedo)
    return Lobe(CosinePowerProfile(1.0, weight=albedo), NORMAL)


def retro(sigma, weight=1.0) -> Lobe:
    """Gaussian lobe back to where the light came from, argument `theta - omega`.

    Args:
        sigma: standard deviation of the lobe [rad].
        weight: integral of the lobe.

    Raises:
        ValueError: if `sigma` is not positive.

    Example:
        >>> from firstorder.transport import retro
        >>> retro(0.1).argument.words
        'theta - omega'
    """
    return Lobe(GaussianProfile(sigma, weight=weight), RETRO)
