"""Radiometry of flatland: quantities with checked units, BRDFs, and reflection in both forms.

Flux is what crosses a curve, irradiance flux per length, radiance flux per angle and projected
length. The cosine integrates to 2 over the hemicircle (in space to pi), so a diffuse BRDF is
`albedo / 2`. Angles are local, counter-clockwise from the normal: w to where light comes from, o to
where it goes; the mirror direction of w is `-w`.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import TypeAlias

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float, PRNGKeyArray

from firstorder._argument_checks import check_not_negative, check_one, nan_unless
from firstorder.conventions import direction
from firstorder.flatland.direct_lighting import Radiance, irradiance
from firstorder.flatland.estimators._incident import incident_radiance, seen_from
from firstorder.flatland.estimators.strata import gap_quadrature, trace_strata
from firstorder.flatland.scene import Scene
from firstorder.flatland.visible import Receiver, local_angle, receiver, view
from firstorder.numerics._compiled import compiled
from firstorder.numerics._planar import cross_2d
from firstorder.numerics._quadrature import gauss_legendre
from firstorder.numerics._refinement import with_errors
from firstorder.sampling._distributions import lobe_area
from firstorder.scene._bands import by_band
from firstorder.scene._geometry_term import geometry_term
from firstorder.typing import as_float

Values: TypeAlias = Float[Array, "*b"]
Brdf: TypeAlias = Callable[[Array, Array], Array]
"""`f(w, o)` in 1/rad: reflected radiance per irradiance, both angles local."""


# --- units ---------------------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class _Unit:
    """A product of powers of base units; the plane angle and the solid angle count as such.

    Example:
        >>> from firstorder.flatland._radiometry import _Unit
        >>> incident_flux = _Unit.of("J") / _Unit.of("s")
        >>> incident_flux == _Unit.of("W"), str(incident_flux / _Unit.of("m rad"))
        (True, 'J s^-1 m^-1 rad^-1')
    """

    powers: tuple[tuple[str, int], ...] = ()

    @staticmethod
    def of(words: str) -> _Unit:
        """Read "W m^-2 sr^-1"; a watt is J/s.

        Raises:
            ValueError: if a word is no unit.
        """
        unit = _Unit()
        for word in words.split():
            name, _, power = word.partition("^")
            if name == "W":
                unit = unit * _Unit((("J", 1), ("s", -1))) ** int(power or 1)
            elif name in BASE:
                unit = unit * _Unit(((name, int(power or 1)),))
            else:
                raise ValueError(f"Argument `words` must hold units of {BASE}, but holds {word!r}.")
        return unit

    def __mul__(self, other: _Unit) -> _Unit:
        total = dict.fromkeys(BASE, 0)
        for name, power in (*self.powers, *other.powers):
            total[name] += power
        return _Unit(tuple((name, power) for name, power in total.items() if power))

    def __pow__(self, power: int) -> _Unit:
        return _Unit(tuple((name, p * power) for name, p in self.powers))

    def __truediv__(self, other: _Unit) -> _Unit:
        return self * other**-1

    def __str__(self) -> str:
        return " ".join(n if p == 1 else f"{n}^{p}" for n, p in self.powers) or "1"


BASE = ("J", "s", "m", "rad", "sr")


@dataclasses.dataclass(frozen=True)
class _Quantity:
    """A row of J12's Table I for one world.

    Attributes:
        name, symbol: of the quantity.
        world: "3D" or "2D".
        expression: its definition.
        unit: derived from the definition, by `_Unit`.
        printed: unit in the table.
    """

    name: str
    symbol: str
    world: str
    expression: str
    unit: _Unit
    printed: str

    @property
    def agrees(self) -> bool:
        """Whether the table's unit is that of the definition."""
        return self.unit == _Unit.of(self.printed)


def _table() -> tuple[_Quantity, ...]:
    """Each unit from the ones above it: no unit is written down but the arguments' own."""
    h, c, wavelength = _Unit.of("J s"), _Unit.of("m s^-1"), _Unit.of("m")
    photon = h * c / wavelength
    spectral = photon / wavelength  # of a density of photons in wavelength; else (3) is not energy
    energy = spectral * wavelength
    flux = energy / _Unit.of("s")
    rows = []
    for world, size, angle in (("3D", _Unit.of("m^2"), "sr"), ("2D", _Unit.of("m"), "rad")):
        per = flux / size
        da, set_ = ("da", "A") if world == "3D" else ("dl", "curve")
        density = f"d Phi({set_}) / {da}"
        units = "W m^-2" if world == "3D" else "W m^-1"
        beam = "(n . w)^+ dw" if world == "3D" else "cos(theta) dtheta"
        radiance = f"d^2 Phi({set_}) / ({beam} {da})"
        rows += [
            _Quantity("spectral radiant energy", "Q_lambda", world, "n_l h c / l", spectral, "J"),
            _Quantity("radiant energy", "Q", world, "int Q_lambda dl", energy, "J"),
            _Quantity("flux", "Phi", world, f"dQ({set_}) / dt", flux, "W"),
            _Quantity("irradiance", "E", world, density, per, units),
            _Quantity("radiosity", "B", world, density, per, units),
            _Quantity(
                "radiance", "L", world, radiance, per / _Unit.of(angle), f"{units} {angle}^-1"
            ),
        ]
    return tuple(rows)


TABLE_I = _table()
"""J12 Table I. All units agree but that of `Q_lambda`, an energy *per wavelength* if (3) is to be
an energy; the paper says in passing that it ignores this."""


# --- what a surface does -------------------------------------------------------------------------


def foreshortening(theta: ArrayLike) -> Values:
    """Projected length per length of curve, `cos(theta)`; zero below the horizon.

    Reference: J12 §3.1, eq. 12.
    """
    theta = as_float(theta)
    return jnp.where(jnp.abs(theta) >= 0.5 * jnp.pi, 0.0, jnp.cos(theta))


def diffuse_brdf(albedo: ArrayLike) -> Brdf:
    """The diffuse BRDF of flatland, `albedo / 2`.

    Args:
        albedo: share of the flux that is reflected, a number; in [0, 1] if energy is to be
            conserved.

    Raises:
        ValueError: if it is negative.

    Reference: J12 §3.2, after eq. 22.

    Example:
        >>> from firstorder.flatland import diffuse_brdf
        >>> diffuse_brdf(0.8)(0.1, -0.3).item()
        0.4
    """
    check_not_negative("albedo", albedo)
    rho = as_float(albedo)
    return lambda w, o: 0.5 * rho * _above(w, o)


def phong_brdf(share: ArrayLike, exponent: ArrayLike) -> Brdf:
    """A lobe `cos^m` about the mirror direction, normalised for flatland.

    `f(w, o) = share cos^m(w + o) / c` with `c = int cos^(m+1)` (see `_cosine_power`), zero beyond a
    right angle from the mirror direction. It is reciprocal; it reflects `share` of light along the
    normal and less of any other, since the horizon cuts the lobe: the convolution of two even bells
    is largest in their middle.

    Args:
        share: of the flux reflected at normal incidence, a number.
        exponent: m, a number, not negative; 0 is a half plane about the mirror direction, and not
            diffuse.

    Raises:
        ValueError: if one is negative.

    Reference: J12 §3.2, eqs. 20 and 22.

    Example:
        >>> from firstorder.flatland import phong_brdf
        >>> mirrorlike = phong_brdf(0.5, 1.0)
        >>> round(mirrorlike(0.3, -0.3).item(), 6)  # 0.5 / int cos^2 = 1 / pi
        0.31831
    """
    check_not_negative("share", share)
    check_not_negative("exponent", exponent)
    k, m = as_float(share), as_float(exponent)

    def f(w, o):
        away = jnp.cos(as_float(w) + o)
        dark = (away <= 0.0) | (jnp.abs(as_float(w) + o) >= 0.5 * jnp.pi)
        power = jnp.exp(m * jnp.log(jnp.where(dark, 1.0, away)))
        return jnp.where(dark, 0.0, k * power / _cosine_power(m + 1.0)) * _above(w, o)

    return f


def _cosine_power(exponent: ArrayLike) -> Values:
    """`int cos^p` over the hemicircle, `sqrt(pi) G((p + 1) / 2) / G(p / 2 + 1)`.

    Example:
        >>> from firstorder.flatland._radiometry import _cosine_power
        >>> round(float(_cosine_power(1.0)), 12)
        2.0
    """
    return lobe_area(as_float(exponent))


def _above(w: ArrayLike, o: ArrayLike) -> Array:
    """One if both directions are above the horizon, else zero; NaN if one of them is."""
    wide = jnp.maximum(jnp.abs(as_float(w)), jnp.abs(as_float(o)))
    return nan_unless(wide == wide, jnp.where(wide < 0.5 * jnp.pi, 1.0, 0.0))


# --- reflection ----------------------------------------------------------------------------------


def _check_reflection(brdf: Brdf, out: ArrayLike) -> None:
    """Refuse an albedo in place of a BRDF, and a row of directions."""
    if not callable(brdf):
        raise TypeError(
            "Argument `brdf` must be a function of two angles, f(w, o), such as diffuse_brdf(0.5)."
        )
    check_one("out", out)


@compiled
@with_errors("nodes")
@by_band()
def reflected_radiance(
    scene: Scene,
    at: Receiver,
    *,
    out: ArrayLike,
    brdf: Brdf,
    radiance: Radiance | None = None,
    nodes: int = 32,
    with_error: bool = False,
) -> Float[Array, ""]:
    """Reflected radiance, the hemicircular form: `L'(o) = int f(w, o) L(w) cos(w) dw`.

    Gauss-Legendre between silhouettes, so that visibility is exact. Valid for lobes that `nodes`
    resolve; point lights do not count.

    Args:
        scene: shapes and environment.
        at: the reflecting point.
        out: local angle to which light goes, one number [rad].
        brdf: `f(w, o)`.
        radiance: what shapes send out in place of their emission (see `irradiance`).
        nodes: in each gap between silhouettes.
        with_error: whether to give an `Approximation`: the answer, and a bound of its error.

    Returns:
        In the direction asked for [W/(m rad)].

    Raises:
        TypeError: if `brdf` is no function.
        ValueError: for a row of receivers or of angles, or if `nodes` is not positive.

    Reference: J12 §3.2, eq. 24.

    Example:
        >>> import jax
        >>> from firstorder.flatland import Receiver, Scene, Segments, primitive
        >>> from firstorder.flatland import diffuse_brdf, reflected_radiance
        >>> scene = Scene.of(primitive(Segments((1.0, 1.0), (-1.0, 1.0)), emission=1.0))
        >>> incident_radiance = jax.jit(lambda at: reflected_radiance(scene, at, out=0.3,
        ...     brdf=diffuse_brdf(0.5)))
        >>> round(float(incident_radiance(Receiver((0.0, 0.0), 0.0))), 6)  # E / 4, E = sqrt(2)
        0.353553
    """
    _check_reflection(brdf, out)
    seen = trace_strata(
        scene, at, where=gap_quadrature(view(scene, at).angles, nodes), radiance=radiance
    )
    w = seen.strata.angles
    return jnp.sum(seen.strata.weights * brdf(w, as_float(out)) * seen.radiance * jnp.cos(w))


@compiled
@by_band()
def reflected_radiance_over_curves(
    scene: Scene,
    at: Receiver,
    *,
    out: ArrayLike,
    brdf: Brdf,
    radiance: Radiance | None = None,
    count: int,
    key: PRNGKeyArray | None = None,
) -> Float[Array, ""]:
    """Reflected radiance, the arc-length form: `L'(o) = int f L V G dl(y)` over all curves.

    `count` points on each shape and one shadow ray to each: visibility is sampled, so the error is
    of first order in the spacing. What the sky sends has no arc length and does not count.

    Args:
        scene: shapes.
        at: the reflecting point.
        out: local angle to which light goes [rad].
        brdf: `f(w, o)`.
        radiance: what shapes send out in place of their emission (see `irradiance`).
        count: points on each shape.
        key: for one random point in each piece; None takes the middle.

    Raises:
        TypeError: if `brdf` is no function.
        ValueError: for a row of angles.

    Reference: J12 §3.2, eqs. 26-27.
    """
    _check_reflection(brdf, out)
    share = 0.5 if key is None else jax.random.uniform(key, (scene.count, count))
    s = (((jnp.arange(count) + share) / count) * jnp.ones((scene.count, 1))).ravel()
    number = jnp.repeat(jnp.arange(scene.count), count)
    frames = jax.vmap(scene.frame)(number, s)
    w = jax.vmap(lambda y: local_angle(at, y))(frames.position)
    along = direction(at.n + w)
    front = cross_2d(frames.tangent, along) < 0.0
    facing = jnp.where(front, 1.0, -1.0)[:, None] * frames.normal
    x = jnp.broadcast_to(at.position, frames.position.shape)
    G = geometry_term(x, jnp.broadcast_to(at.normal, x.shape), frames.position, facing)
    V = seen_from(scene, at, number, frames)
    L = jax.vmap(lambda i, s, f, d: incident_radiance(scene, radiance, i, s, f, d))(
        number, s, front, along
    )
    return jnp.sum(jnp.where(V, brdf(w, as_float(out)) * L * G * frames.speed, 0.0)) / count


def outgoing_radiance(emitted: ArrayLike, reflected: ArrayLike) -> Values:
    """Outgoing radiance by the rendering equation: emitted plus reflected.

    Reference: J12 §3.2, eq. 25, which exchanges the two names on its right.
    """
    return as_float(emitted) + as_float(reflected)


@compiled
@with_errors("nodes")
@by_band()
def incident_flux(
    scene: Scene,
    index: int,
    radiance: Radiance | None = None,
    nodes: int = 32,
    with_error: bool = False,
) -> Array:
    """Flux that arrives on the front of a shape, `int E dl` [W], by Gauss-Legendre along it.

    Valid where the irradiance is smooth; before occluders it has kinks, and `nodes` decides.

    Args:
        scene: shapes and lights.
        index: number of the shape.
        radiance: what shapes send out in place of their emission (see `irradiance`).
        nodes: along the shape. An error is theirs alone: irradiance at each has nodes of its own.
        with_error: whether to give an `Approximation`: the answer, and a bound of its error.

    Raises:
        ValueError: if there is no shape of that number, or `nodes` is not positive.

    Reference: J12 §3.1, eqs. 8, 14 and 16.

    Example:
        >>> from firstorder.flatland import PointLights, Scene, Segments, incident_flux, primitive
        >>> floor = primitive(Segments((-1.0, 0.0), (1.0, 0.0)))
        >>> scene = Scene.of(floor, points=PointLights((0.0, 1.0), 1.0))
        >>> round(incident_flux(scene, 0).item(), 6)  # a quarter of a turn of 1 W/rad
        1.570796
    """
    t, w = (jnp.asarray(a) for a in gauss_legendre(nodes))

    def piece(s):
        speed = scene.frame(index, s).speed
        return irradiance(scene, receiver(scene, index, s), radiance=radiance) * speed

    return jnp.sum(0.5 * w * jax.vmap(piece)(0.5 + 0.5 * t))
