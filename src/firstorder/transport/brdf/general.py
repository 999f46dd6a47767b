"""General BRDFs: functions of the incoming and the outgoing local angle, integrated plainly.

All derivatives are with respect to the *outgoing* angle: in `int L(x, n + w) rho(w, theta - n)
cos(w) dw` the incoming local angle w is the variable of integration and stands still.
"""

import abc
from typing import TypeAlias

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from firstorder._argument_checks import check_finite, check_kind, check_positive, nan_unless
from firstorder._display import Module
from firstorder.fields.kernel import Profile
from firstorder.numerics._select import whole_below
from firstorder.numerics._splines import cubic_b_spline
from firstorder.transport.brdf.lobes import Lobe
from firstorder.transport.events.separable import Angular
from firstorder.typing import Scalar, as_float

Values: TypeAlias = Float[Array, "*b"]
Three: TypeAlias = tuple[Values, Values, Values]
"""A function of one variable, with its first and second derivative."""


class Brdf(Module):
    """`rho(w, o)`: reflected radiance per incident irradiance, both angles local.

    Angles are counter-clockwise from the normal, w to where the light comes from, o to where it
    goes. The cosine is not part of it.
    """

    @abc.abstractmethod
    def derivatives(self, w: Scalar, o: Scalar) -> Three:
        """`rho, rho_o, rho_oo`; zero below the horizon."""

    def peaks(self, o: Scalar) -> list[Scalar]:
        """Incoming angles at which quadrature should split, in no order."""
        return []

    def __call__(self, w, o):
        """The BRDF at broadcast angles."""
        w, o = jnp.broadcast_arrays(as_float(w), as_float(o))
        return jnp.vectorize(lambda a, b: self.derivatives(a, b)[0])(w, o)


class LobeBrdf(Brdf):
    """A lobe as a BRDF: `rho(w, o) = p((turn - 1) n + look theta - w)` in the local frame.

    Every argument can be written in local angles: `-o - w` for mirror lobes, `-w` for diffuse and
    `o - w` for retro lobes.

    Raises:
        TypeError: if it is no lobe, as a kernel alone.
        ValueError: if the lobe varies over the surface.

    Example:
        >>> from firstorder.transport import LobeBrdf, glossy
        >>> mirrorlike = LobeBrdf(glossy(0.2))
        >>> bool(mirrorlike(0.3, -0.3) > mirrorlike(0.3, 0.0))
        True
    """

    lobe: Lobe

    def __check_init__(self):
        """Refuse a lobe that needs to know where it is."""
        check_kind("lobe", self.lobe, Lobe, "a lobe, as `glossy` makes one")
        if not isinstance(self.lobe.kernel, Profile):
            name = type(self.lobe.kernel).__name__
            raise ValueError(f"Argument `lobe` must be the same everywhere, but is a {name}.")

    def derivatives(self, w: Scalar, o: Scalar) -> Three:
        """Chain rule: the argument moves by `look` with o."""
        look, profile = self.lobe.argument.look, self.lobe.kernel
        assert isinstance(profile, Profile)
        below = (jnp.abs(o) > 0.5 * np.pi) | (jnp.abs(w) > 0.5 * np.pi)
        p, d, dd = (jnp.where(below, 0.0, f) for f in profile.derivatives(look * o - w))
        return p, look * d, look**2 * dd

    def peaks(self, o: Scalar) -> list[Scalar]:
        """The lobe's centre and ends."""
        center, h = self.lobe.argument.look * o, self.lobe.kernel.half_width()
        return [center - h, center, center + h]


class Ggx(Brdf):
    """Microfacets distributed like the normals of an ellipse with axes 1 and `roughness`.

    `rho = F(d) D(h) cos d / (a(w) cos o + a(o) cos w)` with half angle `h = (w + o) / 2`,
    `d = (w - o) / 2`, `D(h) = alpha^2 / (2 (alpha^2 cos^2 h + sin^2 h)^(3/2))` and
    `a(t) = sqrt(cos^2 t + alpha^2 sin^2 t)`.

    It is GGX in flatland: `int D cos h dh = 1`; `dw = 2 dh` where space has `4 (o . h)`; and the
    height-correlated masking `2 cos w cos o / (a(w) cos o + a(o) cos w)` cancels the cosines of the
    denominator, so it stays regular at grazing angles. Reciprocal; reflects at most what arrives.

    Args:
        roughness: alpha, the ratio of the axes, positive.
        fresnel: reflectance as a function of the angle d (`Schlick`, `Fresnel`); left out, 1.

    Raises:
        ValueError: if `roughness` is not positive: a perfect mirror has no BRDF, use `Mirror`.

    Reference: derived in derivations/transport/brdf/general.py; R07 §4.1 names Torrance-Sparrow.

    Example:
        >>> from firstorder.transport import Ggx
        >>> rho = Ggx(0.3)
        >>> abs(rho(0.2, -0.5) - rho(-0.5, 0.2)).item()  # reciprocity
        0.0
    """

    roughness: Scalar = eqx.field(converter=as_float)
    fresnel: Angular | None = None

    def __check_init__(self):
        """Refuse the mirror limit."""
        check_positive("roughness", self.roughness)

    def peaks(self, o: Scalar) -> list[Scalar]:
        """About the mirror direction, at a few angular widths of the ellipse's pole."""
        width = jnp.arctan(self.roughness)
        return [-o + k * width for k in (-8.0, -2.0, 0.0, 2.0, 8.0)]

    def derivatives(self, w: Scalar, o: Scalar) -> Three:
        """Product and quotient rule over the factors."""
        below = (jnp.abs(o) >= 0.5 * np.pi) | (jnp.abs(w) >= 0.5 * np.pi)
        w, o = jnp.where(below, 0.0, w), jnp.where(below, 0.0, o)
        d = 0.5 * (w - o)
        cos_d = jnp.cos(d), 0.5 * jnp.sin(d), -0.25 * jnp.cos(d)
        rho = _times(self._facets(0.5 * (w + o)), cos_d)
        if self.fresnel is not None:
            F, F1, F2 = self.fresnel.derivatives(d)
            rho = _times(rho, (F, -0.5 * F1, 0.25 * F2))  # d falls half as fast as o grows
        (a, a1, a2), aw = self._apparent(o), self._apparent(w)[0]
        cos_w, cos_o, sin_o = jnp.cos(w), jnp.cos(o), jnp.sin(o)
        widths = aw * cos_o + a * cos_w, -aw * sin_o + a1 * cos_w, -aw * cos_o + a2 * cos_w
        r, r1, r2 = (jnp.where(below, 0.0, f) for f in _over(rho, widths))
        return r, r1, r2

    def _facets(self, h) -> Three:
        """`D(h)`, and its derivatives in o (h turns half as fast)."""
        roughness = nan_unless(self.roughness > 0, self.roughness)
        excess, square = 1.0 - roughness**2, roughness**2
        q = square * jnp.cos(h) ** 2 + jnp.sin(h) ** 2
        q1, q2 = 0.5 * excess * jnp.sin(2.0 * h), 0.5 * excess * jnp.cos(2.0 * h)
        D = 0.5 * square * q**-1.5
        return D, -1.5 * D * q1 / q, D * (3.75 * q1**2 / q**2 - 1.5 * q2 / q)

    def _apparent(self, t) -> Three:
        """`a(t)`, half the width of the ellipse seen from t, and its derivatives."""
        excess = 1.0 - self.roughness**2
        a = jnp.sqrt(jnp.cos(t) ** 2 + self.roughness**2 * jnp.sin(t) ** 2)
        a1 = -0.5 * excess * jnp.sin(2.0 * t) / a
        return a, a1, (-excess * jnp.cos(2.0 * t) - a1**2) / a


class TabulatedBrdf(Brdf):
    """A measured BRDF: the bicubic spline through values on a grid of incoming x outgoing angles.

    Twice continuously differentiable above the horizon; at the ends of the table, the horizons, the
    outermost two pieces are one cubic (not-a-knot).

    Args:
        values: rho at (w_i, o_j), both equidistant from -pi/2 to pi/2, ends included.

    Raises:
        ValueError: if a value is not finite, or there are fewer than four along one angle.

    Example:
        >>> import numpy as np
        >>> from firstorder.transport import TabulatedBrdf
        >>> round(TabulatedBrdf(np.full((5, 6), 0.5))(0.1, 0.2).item(), 12)
        0.5
    """

    coefficients: Float[Array, "k l"]

    def __init__(self, values):
        """Solve for the coefficients; see the class."""
        values = as_float(values)
        check_finite("values", values)
        if values.ndim != 2 or min(values.shape) < 4:
            raise ValueError(
                "Argument `values` must be a table of four or more each way, "
                f"but has shape {values.shape}."
            )
        rows, columns = (jnp.asarray(_interpolation(n), values.dtype) for n in values.shape)
        self.coefficients = rows @ values @ columns.T

    def derivatives(self, w: Scalar, o: Scalar) -> Three:
        """Four by four B-splines overlap at every pair of angles."""
        below = (jnp.abs(o) > 0.5 * np.pi) | (jnp.abs(w) > 0.5 * np.pi)
        (i, (b, _, _), _), (j, basis, step) = (
            self._overlap(a, n) for a, n in zip((w, o), self.coefficients.shape, strict=True)
        )
        row = jnp.sum(b[:, None] * self.coefficients[i[:, None], j], axis=0)
        rho = [jnp.where(below, 0.0, jnp.sum(row * b) / step**k) for k, b in enumerate(basis)]
        return rho[0], rho[1], rho[2]

    def peaks(self, o: Scalar) -> list[Scalar]:
        """The nodes of the table."""
        n = self.coefficients.shape[0] - 2
        return [jnp.asarray(a, o.dtype) for a in np.linspace(-0.5 * np.pi, 0.5 * np.pi, n)[1:-1]]

    def _overlap(self, angle, count: int):
        """Indices of the four splines that overlap at an angle, their values, and the step."""
        step = np.pi / (count - 3)
        s = (angle + 0.5 * np.pi) / step
        first = jnp.clip(whole_below(s).astype(int), 0, count - 4)
        j = first + jnp.arange(4)
        return j, cubic_b_spline(s - (j - 1.0)), step


def _interpolation(n: int) -> np.ndarray:
    """Matrix from n values to n + 2 coefficients of the not-a-knot spline."""
    matrix = np.zeros((n + 2, n + 2))
    for i in range(n):
        matrix[i, i : i + 3] = 1 / 6, 4 / 6, 1 / 6
    # the third derivative does not jump at the second node, nor at the last but one
    matrix[n, :5] = matrix[n + 1, -5:] = 1.0, -4.0, 6.0, -4.0, 1.0
    return np.linalg.inv(matrix)[:, :n]


def _times(f: Three, g: Three) -> Three:
    """Product of two functions of one variable."""
    return (
        f[0] * g[0],
        f[1] * g[0] + f[0] * g[1],
        f[2] * g[0] + 2.0 * f[1] * g[1] + f[0] * g[2],
    )


def _over(f: Three, g: Three) -> Three:
    """Quotient of two functions of one variable."""
    q = f[0] / g[0]
    q1 = (f[1] - q * g[1]) / g[0]
    return q, q1, (f[2] - 2.0 * q1 * g[1] - q * g[2]) / g[0]
