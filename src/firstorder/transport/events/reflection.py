"""BRDF convolution: each point blurs the mirrored light over angle, by one kernel or its own."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from firstorder._argument_checks import check_kind, check_positive, nan_unless
from firstorder.conventions import Frame, fourier_kernel, frame_with
from firstorder.errors import Refused
from firstorder.fields._coerce import field_of, fields_of, several
from firstorder.fields._series import Series
from firstorder.fields.field import Edge, Field, Sum, _relabelled
from firstorder.fields.jet import Jet
from firstorder.fields.kernel import Kernel, Profile
from firstorder.fields.spectrum import Grid
from firstorder.laws._one_sided import inherited_edges
from firstorder.laws.base import Law
from firstorder.laws.convolve import Convolve, Domain, Line
from firstorder.laws.multiply import Multiply
from firstorder.transport.event import Event, require_frame
from firstorder.typing import Ray, Scalar, as_float


class Reflection(Event):
    """`B_s(x, theta) = int L_m(x, omega) rho(theta - omega) d omega`.

    A lobe that varies in x makes it a spatially varying BRDF,
    `B_s(x, theta) = int L_m(x, omega) rho(x, theta - omega) d omega`: a product in
    (x, Omega_theta), hence a convolution along Omega_x alone in the spectrum.

    Args:
        lobe: BRDF as a kernel of the angle between outgoing and mirror direction.
        domain: line, circle or hemisphere (see `Convolve`).
        nodes: quadrature nodes per smooth piece.
        window: for the spectrum of a lobe that varies in x: the box of its Fourier series.

    Called: BRDF convolution (R07 step 3, D05 step 5).

    Reference: R07 eqs. 14-16, 18-19; D05 eqs. 15-16 and §4.5.

    Example:
        >>> from firstorder.fields import GaussianProfile, gaussian
        >>> from firstorder.transport import Mirror, Reflection
        >>> light = gaussian((0.0, 0.0), (1.0, 0.3)) >> Mirror() >> Reflection(GaussianProfile(0.4))
        >>> round(light.light(0.0, 0.0).item(), 6)  # 0.3 / 0.5: variances add
        0.6
    """

    lobe: Kernel
    domain: Domain = Line()
    nodes: int = eqx.field(static=True, default=64)
    window: Grid | None = None

    def __check_init__(self):
        """Refuse what is no kernel."""
        need = "a kernel, as a `Profile` or the `kernel` of a lobe is"
        check_kind("lobe", self.lobe, Kernel, need)

    def law(self, frame: Frame) -> Law:
        """Convolve along the lobe's angle."""
        require_frame(frame.sense == "outgoing", self, frame, "mirrored light")
        if self.lobe.axis not in frame.coordinates:
            raise ValueError(
                f"Argument `lobe` of {type(self).__name__} must act along one of "
                f"{frame.coordinates}, the coordinates of the light that it meets, but acts along "
                f"{self.lobe.axis!r}."
            )
        return Convolve(self.lobe, self.domain, self.nodes, self.window)


class VaryingGaussian(Kernel):
    """A Gaussian lobe whose width changes over the surface, `sigma(x)`.

    `rho(x, t) = exp(-t^2 / (2 sigma(x)^2)) / (sigma(x) sqrt(2 pi))`.

    Args:
        sigma: the width in radians as a field of position (its other coordinates ignored).
        widest: a bound on the width. The lobe is cut off at nine times its own width, or that of
            this bound if `sigma` has edges.
        axis: name of the angle.

    Valid where `sigma` has no edges, or is no less than a third of `widest`: with edges a
    convolution spreads its nodes over the reach of the widest lobe. With 64 of them light blurred
    by a lobe half, a quarter and an eighth as wide is then off by 5e-8, 4e-3 and 0.4 of it, which
    `with_error` tells; nodes in proportion to `widest / sigma` keep the first of these.

    Raises:
        ValueError: if `widest` is not positive. Where `sigma` is not, the lobe is NaN.

    Reference: D05 §4.5; R07 eq. 18.

    Example:
        >>> from firstorder.transport import VaryingGaussian, wave
        >>> lobe = VaryingGaussian(wave(0.5, 0.1, mean=0.3), widest=0.4)
        >>> lobe(0.0, 0.2).item() < lobe(1.0, 0.0).item()  # wider at x = 0 than at x = 1
        True
    """

    sigma: Field = eqx.field(converter=field_of("sigma"))
    widest: Scalar = eqx.field(converter=as_float)
    axis: str = eqx.field(static=True, default="theta")

    def __check_init__(self):
        """Refuse a width that is not one."""
        check_positive("widest", self.widest)
        frame = frame_with(self.axis, self.frame)
        if frame.coordinates != self.frame.coordinates:
            object.__setattr__(self, "sigma", _relabelled(self.sigma, frame))
        self.frame.axis(self.axis)

    @property
    def frame(self) -> Frame:
        """Frame of the width."""
        return self.sigma.frame

    def half_width(self) -> Scalar:
        """Nine of the widest standard deviation."""
        return 9.0 * nan_unless(self.widest > 0, self.widest)

    def local_half_width(self) -> Field | None:
        """Nine standard deviations; unless they jump, as ends of an integral must not."""
        return None if self.sigma.edges() else 9.0 * self.sigma

    def _width(self, u: Ray) -> Scalar:
        """`sigma(x)`; NaN where the field is no width."""
        s = self.sigma.at(u)
        return nan_unless(s > 0, s)

    def at(self, u: Ray) -> Scalar:
        """The lobe; NaN where `sigma(x)` is not positive."""
        t, s = u[self.frame.axis(self.axis)], self._width(u)
        return jnp.exp(-0.5 * (t / s) ** 2) / (s * np.sqrt(2.0 * np.pi))

    def jet(self, u: Ray) -> Jet:
        """Chain rule through `p(t, s)`, which obeys the heat equation `p_s = s p_tt`."""
        a = self.frame.axis(self.axis)
        s = self.sigma.jet(u)
        r, p = u[a] / s.value, self.at(u)
        # Derivatives of log-scaled Hermite form: p_t = -r p/s, p_tt = (r^2 - 1) p/s^2, ...
        p_t, p_tt = -r * p / s.value, (r**2 - 1.0) * p / s.value**2
        p_s = s.value * p_tt
        p_ts = -(r**3 - 3.0 * r) * p / s.value**2
        p_ss = (r**4 - 5.0 * r**2 + 2.0) * p / s.value**2
        e = jnp.zeros(u.size, u.dtype).at[a].set(1.0)
        mixed = p_ts * e[:, None] * s.gradient
        bend = p_ss * s.gradient[:, None] * s.gradient + p_s * s.hessian
        hessian = p_tt * e[:, None] * e + mixed + mixed.T + bend
        return Jet(p, p_t * e + p_s * s.gradient, hessian, self.frame)

    def edges(self) -> tuple[Edge, ...]:
        """Edges of the width: where one material ends and another begins."""
        return inherited_edges(self.sigma, lambda s: VaryingGaussian(s, self.widest, self.axis))

    def edges_along(self) -> tuple[Edge, ...]:
        """None: the width does not depend on the angle."""
        return ()

    def semi_series(self, Omega_axis: Scalar, window: Grid | None) -> Series:
        """`exp(-2 pi^2 sigma(x)^2 Omega^2)`, sampled over x: its Fourier coefficients."""
        axis = self.frame.positions[0]
        if self.frame.dims - len(self.frame.directions) > 1:
            raise Refused(
                "a width that varies over two positions, or in time, needs a Blend of lobes"
            )
        if window is None:
            raise Refused("a lobe that varies in x needs a window for its Fourier series")
        x, k = window.axis(axis), window.frequencies(axis)
        along = jnp.eye(self.frame.dims)[axis]
        s = jax.vmap(self._width)(x[:, None] * along)
        bell = jnp.exp(-2.0 * (np.pi * s * Omega_axis) ** 2)
        kernel = fourier_kernel(jnp.asarray(k)[:, None, None], x[:, None])
        return Series(jnp.asarray(k)[:, None] * along, kernel @ bell / x.size)


class Blend(Kernel):
    """A combination of fixed lobes with weights that vary over the surface.

    `rho(x, t) = sum_i w_i(x) p_i(t)`: the superposition of several BRDFs, each with a texture.

    Args:
        lobes: profiles p_i along one axis.
        weights: fields w_i over the light's coordinates that ignore the directions.

    Raises:
        ValueError: if there is not one weight for each lobe, or they act along several axes.

    Reference: D05 §4.5, last paragraph; R07 §4.3.

    Example:
        >>> from firstorder.fields import GaussianProfile
        >>> from firstorder.transport import Blend, wave
        >>> w = wave(0.5, 0.5, mean=0.5)
        >>> Blend((GaussianProfile(0.1), GaussianProfile(0.5)), (w, w))(1.0, 0.0).item()
        0.0
    """

    lobes: tuple[Profile, ...] = eqx.field(converter=several("lobes", (Profile,), "profiles"))
    weights: tuple[Field, ...] = eqx.field(converter=fields_of("weights"))

    def __check_init__(self):
        """Refuse lobes without weight, and weights without lobe."""
        if not self.lobes or len(self.lobes) != len(self.weights):
            counts = f"{len(self.lobes)} lobes and {len(self.weights)} weights"
            raise ValueError(f"Arguments `lobes` and `weights` must pair up, but are {counts}.")
        axes = sorted({p.axis for p in self.lobes})
        if len(axes) > 1:
            raise ValueError(f"Argument `lobes` must act along one axis, but does on {axes}.")

    @property
    def axis(self) -> str:
        """The common axis."""
        return self.lobes[0].axis

    @property
    def frame(self) -> Frame:
        """The common frame."""
        return self.lobes[0].frame

    def _sum(self) -> Sum:
        pairs = zip(self.lobes, self.weights, strict=True)
        terms = tuple(Multiply(w)(p) for p, w in pairs)
        return Sum(terms, jnp.ones(len(terms)))

    def half_width(self) -> Scalar:
        """Half width of the widest lobe."""
        widths = jnp.stack([p.half_width() for p in self.lobes])
        # The derivative of `jnp.max` compares the widths with their largest, and is 1 / 0 where
        # the compiler computes a width twice and rounds it in two ways.
        return widths[jnp.argmax(widths)]

    def knots(self) -> Float[Array, " m"]:
        """Those of all lobes."""
        return jnp.concatenate([p.knots() for p in self.lobes])

    def parts(self) -> tuple[Kernel, ...]:
        """Each lobe with its weight: the nodes of a wide one would miss a narrow one."""
        return tuple(Blend((p,), (w,)) for p, w in zip(self.lobes, self.weights, strict=True))

    def at(self, u: Ray) -> Scalar:
        """Weighted sum."""
        return self._sum().at(u)

    def jet(self, u: Ray) -> Jet:
        """Weighted sum, with the weights' derivatives."""
        return self._sum().jet(u)

    def edges(self) -> tuple[Edge, ...]:
        """Edges of lobes and weights."""
        return self._sum().edges()

    def semi_series(self, Omega_axis: Scalar, window: Grid | None) -> Series:
        """The weights' own series, each times its lobe's transform."""
        if window is None:
            raise Refused("a lobe that varies in x needs a window for its Fourier series")
        all_series = [w.series(window) for w in self.weights]
        scaled = [
            s.coefficients * p.transform(Omega_axis)
            for s, p in zip(all_series, self.lobes, strict=True)
        ]
        return Series(jnp.concatenate([s.frequencies for s in all_series]), jnp.concatenate(scaled))
