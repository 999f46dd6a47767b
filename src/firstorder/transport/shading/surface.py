"""Reflected light of a curved, bumpy, textured surface: value, gradient and Hessian, term by term.

The four steps of R07 §4.1 in one: `B(x, theta) = int L(x, omega) rho(2 n(x) - theta - omega)
d omega`. At *fixed offsets* `t = theta_r - omega` a homogeneous lobe is the same for all rays: it
is evaluated once per node, and six sums over the light's jet give everything.
"""

import functools
import math
import operator
from typing import ClassVar, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from firstorder._argument_checks import check_count, check_positive, is_concrete, nan_unless
from firstorder._display import Module, in_print
from firstorder.conventions import FLATLAND, Frame
from firstorder.errors import Refused
from firstorder.fields._coerce import FieldLike, as_field, field_of, field_or_none, several
from firstorder.fields.field import Affine, Edge, Field
from firstorder.fields.jet import Jet
from firstorder.fields.kernel import Profile
from firstorder.laws._edges import kernel_jumps, surviving_edges
from firstorder.laws._one_sided import inherited_edges, still
from firstorder.laws.convolve import Convolve
from firstorder.laws.multiply import Multiply
from firstorder.numerics._batching import in_batches
from firstorder.transport.brdf.general import Brdf
from firstorder.transport.brdf.lobes import Lobe
from firstorder.transport.shading._flat_jets import Entries, Normal, entries_of, unpacked, value_of
from firstorder.transport.shading._horizon import AboveLine
from firstorder.transport.shading._law_images import convolved, over_hemisphere
from firstorder.transport.shading._quadrature import (
    center_of,
    has_cosine,
    local_center,
    offsets,
    weigh,
)
from firstorder.typing import Array, Ray, Scalar, as_float

SOME_RAYS = np.array([[-1.7, -0.4, 0.3, 1.9], [-1.1, 0.2, -0.3, 0.8]])  # at which levels are asked


class DerivativeTerms(NamedTuple):
    """Terms of the spatial derivative of reflected light: `B_x = SV + CDV + MV`.

    Numbers, or arrays of one shape.

    Attributes:
        SV: spatial variation of the light, `L_x (*) rho`.
        DV: its directional variation, `L_theta (*) rho`; for a mirror lobe `B_theta = -DV`.
        CV: curvature, `turn n_x`: 2 n_x for a mirror lobe and n_x for a diffuse one.
        CDV: `CV DV`.
        MV: variation of the material, `L (*) rho_x`, of the texture and of an exact cosine.

    Reference: R07 §5.2; MV is not in its Fig. 4.
    """

    SV: Array
    DV: Array
    CV: Array
    CDV: Array
    MV: Array

    __repr__ = in_print


class Surface(Module):
    """A flatland surface: its normal, its BRDF and its texture.

    Args:
        normal: n as a field over (x, theta) that ignores theta, in radians: a base shape, bumps, or
            their sum; or a function of x, or a number. Counter-clockwise from +y; x is arc length.
        reflectance: lobes and general BRDFs; they add up. One alone needs no tuple.
        texture: field over (x, theta) that ignores theta, or a function of x; it multiplies the
            reflected light.

    Raises:
        TypeError: if an argument is none of these.
        ValueError: if `reflectance` is empty.

    Example:
        >>> from firstorder.fields import Affine, gaussian
        >>> from firstorder.transport import glossy
        >>> from firstorder.transport import Surface
        >>> valley = Surface(Affine([0.5, 0.0], 0.0), (glossy(0.2),))
        >>> B = valley.reflect(gaussian((0.0, 0.1), (1.0, 0.4)))
        >>> B(0.2, 0.1).shape
        ()
    """

    normal: Field = eqx.field(converter=field_of("normal"))
    reflectance: tuple[Lobe | Brdf, ...] = eqx.field(
        converter=several("reflectance", (Lobe, Brdf), "lobes and BRDFs")
    )
    texture: Field | None = eqx.field(converter=field_or_none("texture"), default=None)

    def __check_init__(self):
        """Refuse a surface without material."""
        if not self.reflectance:
            raise ValueError("Argument `reflectance` must hold at least one lobe, but is empty.")

    def normal_at(self, x: Scalar) -> Normal:
        """n, n_x and n_xx at arc length x."""
        jet = self.normal.jet(jnp.stack([x, jnp.zeros_like(x)]))
        return Normal(jet.value, jet.gradient[0], jet.hessian[0, 0])

    def reflect(self, light: FieldLike, nodes: int = 64, above: bool = False) -> "ReflectedField":
        """The reflected light field; see `ReflectedField`.

        Args:
            light: incoming light over (x, theta): a field, or a plain function.
            nodes: Gauss-Legendre nodes per smooth piece.
            above: take only light from above the base line, `AboveLine(light)`: needed by light
                that came through slopes.
        """
        light = as_field(light, "light", FLATLAND)
        return ReflectedField(AboveLine(light) if above else light, self, nodes)


class ReflectedField(Field):
    """Light reflected by a surface, as an outgoing light field.

    For every lobe, with `theta_r = 2 n(x) - theta` and (*) the convolution over angle at theta_r,

    `B        = L (*) rho`
    `B_x      = L_x (*) rho + 2 n_x L_theta (*) rho`
    `B_theta  = -L_theta (*) rho`
    `B_xx     = L_xx (*) rho + 4 n_x L_xtheta (*) rho + 4 n_x^2 L_thetatheta (*) rho
    + 2 n_xx L_theta (*) rho`
    `B_xtheta = -(L_xtheta (*) rho + 2 n_x L_thetatheta (*) rho)`
    `B_thetatheta = L_thetatheta (*) rho`

    For a lobe with another argument 2 becomes `turn` and -1 `look`. A lobe that varies in x, a
    texture and an exact cosine add terms by Leibniz' rule; the cosine also adds
    `L rho grad m grad m^T` at each horizon `omega = n -+ pi/2` in the lobe's reach, with m the
    lobe's local centre. A general BRDF is integrated over the local hemisphere,
    `int L(x, n + w) rho(w, theta - n) cos(w) dw`, whose ends stand still.

    Light with edges is integrated piece by piece with the boundary terms of `Integrate`.
    A lobe may reach below the base line, |omega| > pi/2, where light that came through slopes
    (`ToAngle`, `Travel` in angles) is NaN: reflect `AboveLine(light)`, or with `above=True`.
    Angles are global, theta is held fixed under d/dx. Wrong when the lobe reaches around the
    circle.

    Args:
        light: incoming light over (x, theta).
        surface: the surface.
        nodes: Gauss-Legendre nodes per smooth piece.

    Raises:
        ValueError: if the light is not incoming flatland light in angles.

    Reference: R07 eqs. 18-25, 29, 68-69, §5.2, §5.4.

    Example:
        >>> from firstorder.fields import Affine, gaussian
        >>> from firstorder.transport import glossy
        >>> from firstorder.transport import Surface
        >>> B = Surface(Affine([0.5, 0.0], 0.0), (glossy(0.2),)).reflect(
        ...     gaussian((0.0, 0.1), (1.0, 0.4)))
        >>> terms, = B.terms(0.2, 0.1)
        >>> bool(abs(B.jets(0.2, 0.1).gradient[0] - terms.SV - terms.CDV) < 1e-12)
        True
    """

    REFINED: ClassVar = ("nodes",)

    light: Field = eqx.field(converter=field_of("light"))
    surface: Surface
    nodes: int = eqx.field(static=True, default=64)

    def __check_init__(self):
        """Refuse other coordinates."""
        check_count("nodes", self.nodes)
        if self.light.frame != FLATLAND:
            f = self.light.frame
            raise ValueError(
                f"Argument `light` must be incoming in {FLATLAND.coordinates}, "
                f"but is {f.sense} in {f.coordinates}."
            )

    @property
    def frame(self) -> Frame:
        """Frame of the light, outgoing."""
        return self.light.frame.turned()

    def at(self, u: Ray) -> Scalar:
        """Sum over the lobes, times the texture."""
        x, theta = u
        n = self.surface.normal_at(x)
        parts = (part for r in self.surface.reflectance for part in _parts(r))
        total = sum((self._value(r, n, x, theta) for r in parts), 0.0 * x)
        texture = self.surface.texture
        return total if texture is None else texture.at(u) * total

    def jet(self, u: Ray) -> Jet:
        """Value, gradient and Hessian in closed form."""
        return self.entries(u[0], u[1]).jet(self.frame)

    def edges(self) -> tuple[Edge, ...]:
        """Edges of texture and normal, and those of light and lobes that ignore theta.

        Others are smoothed away, unless one that bends happens to run along theta.
        """
        texture, reflectance = self.surface.texture, self.surface.reflectance
        of_light = tuple(
            Edge(e.level, ReflectedField(e.jump, self.surface, self.nodes))
            for e in surviving_edges(self.light.edges(), 1)
            if _ignores_theta(e.level)
        )
        of_lobes = tuple(
            Edge(level, self._on(Lobe(kernel, r.argument, r.cosine), texture))
            for r in reflectance
            if isinstance(r, Lobe)
            for level, kernel in kernel_jumps(r.kernel)
            if _ignores_theta(level)
        )
        bare = Multiply(self._on(reflectance, None))
        painted = () if texture is None else texture.edges()
        of_paint = tuple(Edge(e.level, bare(e.jump)) for e in painted)
        turned = inherited_edges(
            self.surface.normal, lambda n: self._on(reflectance, texture, normal=n)
        )
        creases = tuple(Edge(still(e.level, self.frame), e.jump) for e in turned)
        return of_light + of_lobes + of_paint + creases

    def _on(
        self, reflectance, texture: Field | None, normal: Field | None = None
    ) -> "ReflectedField":
        """Reflection of the light by another material, and maybe another shape."""
        shape = self.surface.normal if normal is None else normal
        return ReflectedField(self.light, Surface(shape, reflectance, texture), self.nodes)

    def entries(self, x: Scalar, theta: Scalar) -> Entries:
        """The jet as six numbers."""
        x, theta = as_float(x), as_float(theta)
        n = self.surface.normal_at(x)
        parts = (part for r in self.surface.reflectance for part in _parts(r))
        first, *rest = (self._entries(r, n, x, theta) for r in parts)
        for more in rest:
            first = first + more
        return first if self.surface.texture is None else self._painted(x).times(first)

    def gradient(self, x: Scalar, theta: Scalar) -> tuple[Scalar, Scalar, Scalar]:
        """`B, B_x, B_theta`, without the work that only the Hessian needs.

        Unused outputs of a loop are removed by the compiler, so this is `entries`, cut.
        """
        return self.entries(x, theta)[:3]

    def terms(self, x, theta) -> tuple[DerivativeTerms, ...]:
        """SV, DV, CV, CDV and MV of every lobe (general BRDFs: `turn` is 1, as for their light).

        Args:
            x: arc length, an array of any shape.
            theta: outgoing direction, broadcast against x.

        Raises:
            Refused: for light with edges, unless all lobes are without cosine.
        """
        x, theta = jnp.broadcast_arrays(*map(as_float, (x, theta)))
        many = jax.vmap(self._terms)(x.ravel(), theta.ravel())
        return jax.tree.map(lambda a: a.reshape(x.shape), many)

    def over(self, x, theta, block: int = 2048) -> Entries:
        """Entries at many rays, in blocks that fit the cache.

        Args:
            x: arc lengths, one axis.
            theta: outgoing directions, likewise.
            block: rays at a time.
        """
        rays = as_float(x), as_float(theta)
        return in_batches(lambda a: self.entries(*a), rays, block)

    # --- one lobe or BRDF -------------------------------------------------------------------

    def _value(self, r: Lobe | Brdf, n: Normal, x: Scalar, theta: Scalar) -> Scalar:
        if self.light.edges():
            field, ray = self._law_image(r, n, x, theta)
            return field.at(ray)
        *_, center = center_of(r, n, theta)
        nodes, weights, weight = weigh(r, n, x, theta, self.nodes)

        def node(t):
            return value_of(self.light, x, center - t) * weight(t).value

        return jnp.sum(weights * jax.vmap(node)(nodes))

    def _entries(self, r: Lobe | Brdf, n: Normal, x: Scalar, theta: Scalar) -> Entries:
        if self.light.edges():
            return self._by_laws(r, n, x, theta)
        if isinstance(r, Lobe) and isinstance(r.kernel, Profile) and not r.cosine:
            turn, look, center = center_of(r, n, theta)
            return self._sums(r.kernel, x, center).turned(n, turn, look)
        return self._leibniz(r, n, x, theta)

    def _sums(self, profile: Profile, x: Scalar, center: Scalar) -> Entries:
        """The six entries of L, convolved: the lobe is evaluated once for all rays."""
        h = profile.half_width().astype(x.dtype)
        t, w = offsets(profile, -h, h, self.nodes)
        weights = (w * jax.vmap(lambda s: profile.derivatives(s)[0])(t)).astype(x.dtype)

        def part(nodes):
            pairs = zip(*nodes, strict=True)
            first, *rest = [entries_of(self.light, x, center - s).scaled(w) for s, w in pairs]
            return functools.reduce(operator.add, rest, first)

        # Sums of eight nodes, each written to its own place: a loop that adds to what it reads is
        # not vectorised by every compiler.
        some = (a.reshape(-1, math.gcd(t.size, 8)) for a in (t, weights))
        return Entries(*(jnp.sum(e, 0) for e in jax.lax.map(part, tuple(some))))

    def _leibniz(self, r: Lobe | Brdf, n: Normal, x: Scalar, theta: Scalar) -> Entries:
        """Light and weight both vary with the ray: product rule under the integral sign."""
        turn, look, center = center_of(r, n, theta)
        nodes, weights, weight = weigh(r, n, x, theta, self.nodes)

        def node(t):
            return entries_of(self.light, x, center - t).turned(n, turn, look).times(weight(t))

        total = Entries(*(jnp.sum(weights * e) for e in jax.vmap(node)(nodes)))
        return total + self._horizons(r, n, x, theta) if has_cosine(r) else total

    def _horizons(self, r: Lobe, n: Normal, x: Scalar, theta: Scalar) -> Entries:
        """`L rho m_i m_j` at `omega = n -+ pi/2`: the cosine has a kink there, and it moves."""
        m, kernel = local_center(r, n, theta), r.kernel
        total = jnp.zeros_like(x)
        for side in (-0.5 * np.pi, 0.5 * np.pi):
            t = m.value + side
            rho = kernel.at(jnp.stack([x, t]))
            light = self.light.at(jnp.stack([x, n.value - side]))
            total = total + jnp.where(jnp.abs(t) < kernel.half_width(), light * rho, 0.0)
        zero = jnp.zeros_like(x)
        bend = m.x * m.x, m.x * m.theta, m.theta * m.theta
        return Entries(zero, zero, zero, *(total * b for b in bend))

    def _by_laws(self, r: Lobe | Brdf, n: Normal, x: Scalar, theta: Scalar) -> Entries:
        """Reflected light as composed laws, which split the integral at the light's edges."""
        field, ray = self._law_image(r, n, x, theta)
        entries = unpacked(field.jet(ray))
        turn, look, _ = center_of(r, n, theta)
        return entries if isinstance(r, Brdf) else entries.turned(n, turn, look)

    def _law_image(self, r: Lobe | Brdf, n: Normal, x: Scalar, theta: Scalar) -> tuple[Field, Ray]:
        """Convolved light and where to read it, or what a general BRDF reflects, and the ray."""
        given = self.light, self.surface.normal, self.nodes
        if isinstance(r, Brdf):
            return over_hemisphere(r, *given), jnp.stack([x, theta])
        *_, center = center_of(r, n, theta)
        return convolved(r, *given), jnp.stack([x, center])

    # --- the terms --------------------------------------------------------------------------

    def _terms(self, x: Scalar, theta: Scalar) -> tuple[DerivativeTerms, ...]:
        n = self.surface.normal_at(x)
        return tuple(self._terms_of_all(r, n, x, theta) for r in self.surface.reflectance)

    def _terms_of_all(self, r: Lobe | Brdf, n: Normal, x: Scalar, theta: Scalar) -> DerivativeTerms:
        """Those of a lobe's parts, which turn alike, added."""
        SV, DV, CV, CDV, MV = zip(*(self._terms_of(p, n, x, theta) for p in _parts(r)), strict=True)
        return DerivativeTerms(sum(SV), sum(DV), CV[0], sum(CDV), sum(MV))

    def _terms_of(self, r: Lobe | Brdf, n: Normal, x: Scalar, theta: Scalar) -> DerivativeTerms:
        """By their definitions, and not from B_x."""
        turn, _, center = center_of(r, n, theta)
        if self.light.edges():
            B, SV, DV, MV = self._split_terms(r, x, center)
        else:
            nodes, weights, weight = weigh(r, n, x, theta, self.nodes)

            def node(t):
                L, q = entries_of(self.light, x, center - t), weight(t)
                return L.value * q.value, L.x * q.value, L.theta * q.value, L.value * q.x

            B, SV, DV, MV = (jnp.sum(weights * e) for e in jax.vmap(node)(nodes))
        if self.surface.texture is not None:
            paint = self._painted(x)
            SV, DV, MV = paint.value * SV, paint.value * DV, paint.value * MV + paint.x * B
        CV = turn * n.x
        return DerivativeTerms(SV, DV, CV, CV * DV, MV)

    def _split_terms(self, r: Lobe | Brdf, x: Scalar, center: Scalar):
        """Under light with edges L_x and L_theta hold Diracs: convolve, then differentiate."""
        if not isinstance(r, Lobe) or r.cosine or not isinstance(r.kernel, Profile):
            raise Refused("terms under light with edges need a homogeneous lobe without cosine")
        jet = Convolve(r.kernel, nodes=self.nodes)(self.light).jet(jnp.stack([x, center]))
        return jet.value, jet.gradient[0], jet.gradient[1], jnp.zeros_like(jet.value)

    def _painted(self, x: Scalar) -> Entries:
        """The texture's entries; it does not depend on the direction."""
        assert self.surface.texture is not None
        e = entries_of(self.surface.texture, x, jnp.zeros_like(x))
        zero = jnp.zeros_like(x)
        return Entries(e.value, e.x, zero, e.xx, zero, zero)


def _ignores_theta(level: Field) -> bool:
    """Whether a level is the same at all angles, as far as some rays tell.

    Straight levels that are not have been taken out before. A level of traced numbers counts as one
    that is: it cannot be asked.
    """
    if isinstance(level, Affine) or not is_concrete(level):
        return True
    with jax.ensure_compile_time_eval():
        return not np.any(level.jets(*SOME_RAYS).gradient[..., 1])


def _parts(r: Lobe | Brdf) -> tuple[Lobe | Brdf, ...]:
    """Lobes of which one is the sum, as its kernel is."""
    if isinstance(r, Brdf):
        return (r,)
    return tuple(Lobe(kernel, r.argument, r.cosine) for kernel in r.kernel.parts())


def far_light_ratio(D, local, kappa, turn=2.0) -> Array:
    """Ratio `|L_x| / |turn n_x L_theta|` of a source that shines all ways: small for far light.

    Such a source obeys `L_x = -cos(omega - n_0) / D L_theta`, whatever its shape: moving along the
    base and turning the ray shift the point of the source that is seen alike. So the ratio is
    `cos(omega - n_0) / (turn |n_x| D)`; light is far where it is much below 1, and near where it is
    above. On a flat base under a plane of light at height d, `cos(omega - n_0) / D` is
    `cos(omega)^2 / d`, the paper's 1/d overhead. The sign makes the two parts cancel in a valley
    that is focused on the source.

    Wrong for a source with a beam, and across its edges as seen past a blocker.

    Args:
        D: distance to the source along the ray, in metres; positive.
        local: angle between the ray and the base's normal, `omega - n_0`, in radians.
        kappa: n_x of the shading normal, in radians per metre; zero gives infinity.
        turn: 2 for a mirror lobe, 1 for a diffuse one.

    Raises:
        ValueError: if `D` is not positive.

    Reference: R07 §5.2, whose L_x ~ L_theta / d lacks the sign and the cosines.

    Example:
        >>> from firstorder.transport import far_light_ratio
        >>> far_light_ratio(2.0, 0.0, 0.25).item()
        1.0
    """
    check_positive("D", D)
    D, local, kappa = map(as_float, (D, local, kappa))
    return jnp.abs(jnp.cos(local)) / (turn * jnp.abs(kappa) * nan_unless(D > 0, D))
