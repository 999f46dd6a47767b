"""Convolve along one axis: a product, integrated.

`h(u) = int f(u; axis = s) g(u; axis = u_axis - s) ds`. In the n + 1 coordinates (u, s) this is
two moves, one product and one integral, so edges, jets and boundary terms need no words of
their own.
"""

from __future__ import annotations

import abc
from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from firstorder._argument_checks import check_count, check_kind
from firstorder._display import Module
from firstorder.conventions import Frame
from firstorder.errors import Refused
from firstorder.fields._coerce import field_of
from firstorder.fields.covariance import Covariance
from firstorder.fields.extent import Extent
from firstorder.fields.field import Affine, Constant, Edge, Field, Sum
from firstorder.fields.jet import Jet
from firstorder.fields.kernel import GaussianProfile, Kernel
from firstorder.fields.spectrum import Grid, Spectrum
from firstorder.laws._edges import kernel_jumps, surviving_edges
from firstorder.laws._one_sided import inherited_edges
from firstorder.laws.base import Law
from firstorder.laws.integrate import Integrate
from firstorder.laws.move import Move
from firstorder.laws.multiply import Multiply
from firstorder.typing import ComplexScalar, Frequency, Ray, Scalar

_DUMMY = "omega"


def _reach(kernel: Kernel, wide: Frame) -> Field:
    """How far from the middle a kernel is integrated: past edges of its own.

    An end of the integral that moves with an edge would be taken for neither side of it.
    """
    local = kernel.local_half_width()
    if local is not None:
        return Move(np.eye(wide.dims - 1, wide.dims), to=wide)(local)
    return Constant(kernel.half_width() * (1.0625 if kernel.edges_along() else 1.0), wide)


class Domain(Module):
    """The domain of an axis, which sets the ends of a convolution's integral."""

    @abc.abstractmethod
    def ends(self, kernel: Kernel, wide: Frame) -> tuple[Field, Field]:
        """Ends of the integral as fields over the n + 1 coordinates."""


class Line(Domain):
    """The whole real line: as far as the kernel reaches.

    Example:
        >>> from firstorder.fields import GaussianProfile, gaussian
        >>> from firstorder.laws import Convolve, Line
        >>> blur = Convolve(GaussianProfile(0.75), domain=Line())
        >>> F = blur(gaussian((0.0, 0.0), (1.0, 1.0))).spectrum()
        >>> round(F(0.0, 0.0).real.item(), 6)  # 2 pi, as before: the blur keeps the light
        6.283185
    """

    def ends(self, kernel: Kernel, wide: Frame) -> tuple[Field, Field]:
        """`u_axis -+ half_width`."""
        reach = _reach(kernel, wide)
        return _Reached(reach, kernel.axis, -1.0), _Reached(reach, kernel.axis, 1.0)


class Circle(Domain):
    """All directions: field and kernel have period 2 pi; the spectrum is a Fourier series.

    The spectrum rule then holds at the frequencies m / (2 pi), where a period's transform is
    2 pi times the Fourier coefficient.

    Example:
        >>> from firstorder.conventions import Frame
        >>> from firstorder.fields import GaussianProfile, Harmonics
        >>> from firstorder.laws import Circle, Convolve
        >>> blur = Convolve(GaussianProfile(0.3, "theta", Frame(("theta",))), domain=Circle())
        >>> round(blur(Harmonics([1.0, 0.0], [0.0, 0.0]))(0.2).item(), 6)
        1.0
    """

    def ends(self, kernel: Kernel, wide: Frame) -> tuple[Field, Field]:
        """One period about `u_axis`, or as far as a narrow kernel reaches."""
        reach = _reach(kernel, wide)
        lower = _Reached(reach, kernel.axis, -1.0, np.pi)
        return lower, _Reached(reach, kernel.axis, 1.0, np.pi)


class Hemisphere(Domain):
    """Directions above the horizon of a normal at angle n(x): ends move, and have end terms.

    Args:
        normal: n as a field over the coordinates (its direction coordinate ignored), or a function
            of x, or a number.

    Example:
        >>> from firstorder.fields import Affine
        >>> from firstorder.laws import Hemisphere
        >>> Hemisphere(Affine([2.0, 0.0], 0.0)).normal(0.25, 0.0).item()  # a valley of curvature 2
        0.5
    """

    normal: Field = eqx.field(converter=field_of("normal"))

    def ends(self, kernel: Kernel, wide: Frame) -> tuple[Field, Field]:
        """`n -+ pi / 2`, but no farther from `u_axis` than the kernel reaches."""
        n = Move(np.eye(wide.dims - 1, wide.dims), to=wide)(self.normal)
        quarter, reach = Constant(0.5 * np.pi, wide), _reach(kernel, wide)
        lower, upper = n + (-1.0) * quarter, n + quarter
        return _Near(lower, kernel.axis, reach), _Near(upper, kernel.axis, reach)


class _Reached(Field):
    """Where a kernel ends on one side of `u_axis`, or a distance before.

    Nothing passes it there: it moves with `u_axis`, and how it moves besides adds nothing to jets.
    """

    reach: Field
    axis: str = eqx.field(static=True)
    sign: float = eqx.field(static=True)
    most: float = eqx.field(static=True, default=np.inf)

    @property
    def frame(self) -> Frame:
        """Frame of the reach."""
        return self.reach.frame

    def at(self, u: Ray) -> Scalar:
        """Where the integral ends."""
        return u[self.frame.axis(self.axis)] + self.sign * jnp.minimum(self.most, self.reach.at(u))

    def jet(self, u: Ray) -> Jet:
        """Jet of a constant distance from `u_axis`."""
        along = jnp.zeros(u.size, u.dtype).at[self.frame.axis(self.axis)].set(1.0)
        return Jet(self.at(u), along, jnp.zeros((u.size, u.size), u.dtype), self.frame)


class _Near(Field):
    """An end of an integral, or the nearest place to it within a reach of `u_axis`."""

    end: Field
    axis: str = eqx.field(static=True)
    reach: Field

    @property
    def frame(self) -> Frame:
        """Frame of the end."""
        return self.end.frame

    def at(self, u: Ray) -> Scalar:
        """Where the integral ends."""
        return self.jet(u).value

    def jet(self, u: Ray) -> Jet:
        """Jet of the end, or of the place that goes with `u_axis`."""
        end, a = self.end.jet(u), self.frame.axis(self.axis)
        away = end.value - u[a]
        reach = self.reach.at(u)
        here = Affine(jnp.eye(u.size, dtype=u.dtype)[a], jnp.sign(away) * reach, self.frame)
        beyond = jnp.abs(away) > reach
        return jax.tree.map(lambda x, y: jnp.where(beyond, x, y), here.jet(u), end)


class Convolve(Law):
    """`h = f (*)_axis g`, over a named domain.

    Jet: that of the product integrated (R07 eq. 4 and, for a kernel that varies, eq. 19).
    Spectrum: `H = F G` for a kernel of the difference alone (D05 eq. 16), and the
    semi-convolution `sum_k c_k(Omega_axis) F(Omega - s_k)` for one that varies in x (D05 §4.5).
    Covariance: `(Sigma^-1 + e e^T / s)^-1` with the kernel's spread s; exact for Gaussians.
    Wavelet: refused.

    Args:
        kernel: what to convolve with; it names its axis.
        domain: line, circle or hemisphere.
        nodes: quadrature nodes per smooth piece.
        window: for the spectrum of a kernel that varies: the box of its Fourier series.

    Example:
        >>> from firstorder.fields import GaussianProfile, gaussian
        >>> from firstorder.laws import Convolve
        >>> blur = Convolve(GaussianProfile(1.0))
        >>> round(blur(gaussian((0.0, 0.0), (1.0, 1.0)))(0.0, 0.0).item(), 12)  # 1 / sqrt(2)
        0.707106781187
    """

    REFINED: ClassVar = ("nodes", "window")

    kernel: Kernel
    domain: Domain = Line()
    nodes: int = eqx.field(static=True, default=64)
    window: Grid | None = None

    def __check_init__(self):
        """Refuse what is no kernel."""
        check_count("nodes", self.nodes)
        check_kind("kernel", self.kernel, Kernel, "a kernel, as a `Profile` is")
        check_kind("domain", self.domain, Domain, "a `Line`, a `Circle` or a `Hemisphere`")

    def _image(self, f: Field) -> Field:
        """The convolution as a field over u, each part of the kernel over its own reach."""
        parts = self.kernel.parts()
        images = tuple(self._with(g)._integral(f) for g in parts) if len(parts) > 1 else ()
        return Sum(images, jnp.ones(len(images))) if images else self._integral(f)

    def _with(self, kernel: Kernel, domain: Domain | None = None) -> "Convolve":
        """A convolution with another kernel, and maybe another domain, the rest as here."""
        return Convolve(kernel, domain or self.domain, self.nodes, self.window)

    def _integral(self, f: Field) -> Field:
        """`Integrate(Multiply(moved g)(moved f))` with the whole kernel g at once."""
        a = f.frame.axis(self.kernel.axis)
        n = f.frame.dims
        wide = f.frame.appended(_DUMMY)
        source, difference = np.eye(n, n + 1), np.eye(n, n + 1)
        source[a, a], source[a, n] = 0.0, 1.0
        difference[a, n] = -1.0
        product = Multiply(Move(difference, to=wide)(self.kernel))(Move(source, to=wide)(f))
        lower, upper = self.domain.ends(self.kernel, wide)
        knots = self.kernel.knots()
        here = np.eye(wide.dims)[a]
        breaks = tuple(Affine(here, -k, wide) for k in knots)  # where u_axis - s is a knot
        # A piece between knots is short: few nodes do.
        nodes = max(min(4, self.nodes), self.nodes // (len(knots) + 1))
        return Integrate(_DUMMY, lower, upper, nodes, breaks)(product)

    def value(self, f: Field, u: Ray) -> Scalar:
        """The product, integrated."""
        return self._image(f).at(u)

    def jet(self, f: Field, u: Ray) -> Jet:
        """The jet of the product, integrated, with its boundary terms."""
        return self._image(f).jet(u)

    def edges(self, f: Field) -> tuple[Edge, ...]:
        """Edges that run along the axis survive, their jump convolved; others are smoothed away.

        So do the kernel's own, where one material ends and another begins, and those of a
        horizon's normal.
        """
        a = f.frame.axis(self.kernel.axis)
        of_light = tuple(Edge(e.level, self(e.jump)) for e in surviving_edges(f.edges(), a))
        jumps = kernel_jumps(self.kernel)
        of_kernel = tuple(Edge(level, self._with(g)(f)) for level, g in jumps)
        if not isinstance(self.domain, Hemisphere):
            return of_light + of_kernel
        horizon = inherited_edges(
            self.domain.normal, lambda n: self._with(self.kernel, Hemisphere(n))(f)
        )
        return of_light + of_kernel + surviving_edges(horizon, a)

    def spectrum(self, F: Spectrum, Omega: Frequency) -> ComplexScalar:
        """Multiply along the axis, convolve along what the kernel varies in."""
        if isinstance(self.domain, Hemisphere):
            raise Refused("a horizon is not shift-invariant: multiply by it first, then convolve")
        series = self.kernel.semi_series(Omega[F.frame.axis(self.kernel.axis)], self.window)
        shifted = jax.vmap(F.at)(Omega - series.frequencies)
        return jnp.sum(series.coefficients * shifted)

    def extent(self, extent: Extent, frame: Frame) -> Extent | None:
        """Wider by the kernel, on the line; not known on a circle."""
        if not isinstance(self.domain, Line):
            return None
        axis = frame.axis(self.kernel.axis)
        if isinstance(self.kernel, GaussianProfile) and type(self.kernel) is GaussianProfile:
            return extent.widened(axis, self.kernel.sigma, 0.0)
        return extent.widened(axis, 0.0, self.kernel.half_width())

    def covariance(self, S: Covariance) -> Covariance:
        """Woodbury's form of `(Sigma^-1 + e e^T / s)^-1`."""
        if not isinstance(self.domain, Line):
            raise Refused("the covariance rule is for the whole line, not for a circle or horizon")
        a = S.frame.axis(self.kernel.axis)
        column = S.matrix[:, a]
        both = S.matrix[a, a] + self.kernel.spread()
        matrix = S.matrix - jnp.outer(column, column) / jnp.where(both == 0, 1.0, both)
        return Covariance(matrix, S.frame)
