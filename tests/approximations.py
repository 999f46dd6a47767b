"""Random cases of every answer that tells its error, with the truth from elsewhere or much finer.

`python -m tests.approximations` prints, for each: in what share of the cases the error is a bound,
and how many times the true error it is, in the median. Half of the cases are smooth, the others
have a kink, or an edge, that no rule knows of, wherever the question allows one.
"""

from __future__ import annotations

import sys
import zlib
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import scipy.interpolate
from jaxtyping import Array

from firstorder import flatland, space
from firstorder.caching import Candidates, circular_regions, true_error
from firstorder.conventions import FLATLAND, Frame
from firstorder.fields import (
    BoxProfile,
    Constant,
    Function,
    Gaussian,
    GaussianProfile,
    Grid,
    SampledSpectrum,
    Separable,
    gaussian,
)
from firstorder.flatland import Circles, Receiver, Scene, Segments, primitive
from firstorder.flatland.bounces import Discretization, solve_radiosity
from firstorder.flatland.estimators import arc_length_integral
from firstorder.laws import Convolve, Integrate, Multiply, VonMisesFisher, Zonal
from firstorder.sampling import expected_k_nearest
from firstorder.shadowfield import (
    PLANE,
    TWO_PLANES,
    ShadowSpectrum,
    factoring_bound,
    mean_form_factor,
    planar_blocker,
    shadow_irradiance,
)
from firstorder.space.azimuthal import (
    irradiance_by_azimuth,
    transport_by_azimuth,
    visibility_by_azimuth,
)
from firstorder.transport import Surface, glossy
from firstorder.visibility import angular_derivative_by_parts, autodiff_edges, shading_derivatives

COUNT = 200  # cases of each
CLEAR = 1e3  # units in the last place from which on an error is more than rounding


class Measured(NamedTuple):
    """What the errors of one function are worth.

    Attributes:
        bound: share of the numbers whose error is a bound.
        ratio: median of error over true error, among those that are wrong by more than rounding.
        clear: share of those.
        size: how many numbers.
    """

    bound: float
    ratio: float
    clear: float
    size: int


def judged(value: Any, error: Any, truth: Any) -> Measured:
    """Errors beside true errors; arrays, or trees of them, of one form."""
    V, E, T = (
        np.concatenate([np.ravel(leaf) for leaf in jax.tree.leaves(tree)])
        for tree in (value, error, truth)
    )
    assert V.shape == E.shape == T.shape
    assert np.isfinite(V).all()
    off = np.abs(V - T)
    clear = off > CLEAR * np.finfo(V.dtype).eps * np.maximum(np.abs(V), np.abs(T))
    ratio = float(np.median(E[clear] / off[clear])) if clear.any() else np.nan
    # The truth is rounded, too.
    bound = float(np.mean(off <= E + 4.0 * np.finfo(V.dtype).eps * np.abs(T)))
    return Measured(bound, ratio, float(clear.mean()), V.size)


def measured(name: str) -> Measured:
    """The cases of one function, by name; their numbers are drawn by its name."""
    return judged(*CASES[name](np.random.default_rng(zlib.crc32(name.encode()))))


CASES: dict[str, Callable] = {}


def case(f: Callable, count: int = COUNT) -> Callable:
    """Registers a function of random numbers (8,) that gives an approximation and the truth."""

    def run(rng):
        u = jnp.asarray(rng.uniform(size=(count, 8)))
        kinked = jnp.asarray(np.arange(count) % 2, float)
        (value, error), truth = jax.jit(jax.vmap(f))(u, kinked)
        return value, error, truth

    CASES[f.__name__] = run
    return f


def light(u, kinked):
    """Radiance of an angle: waves, and in half of the cases a kink somewhere."""
    return lambda a: (
        1.5 + jnp.cos((1.0 + 3.0 * u[5]) * a + 6.0 * u[6]) + kinked * jnp.abs(a - 2.0 * u[7] + 1.0)
    )


# --- flatland ------------------------------------------------------------------------------------


def room(u, kinked):
    """A lamp and a ball under a sky, and a receiver below."""
    lamp = Segments((1.0 + u[0], 2.0), (-0.3 * u[1], 2.2 + u[1]))
    ball = Circles((-1.0 + 2.0 * u[2], 0.7 + 0.7 * u[3]), 0.3)
    shapes = (primitive(lamp, emission=0.7), primitive(ball, emission=0.2, albedo=0.5))
    return Scene.of(*shapes, environment=light(u, kinked)), Receiver((u[4], 0.0), 0.2 * u[0])


def _asked(f, *args, nodes, fine, **options):
    """An approximation, and the same by a rule so fine that it counts as the truth."""
    found = f(*args, nodes=nodes, with_error=True, **options)
    return found, f(*args, nodes=fine, **options)


@case
def flatland_irradiance(u, kinked):
    def sent(index, s, front, along):
        return 1.0 + jnp.sin(8.0 * s + u[6])

    return _asked(flatland.irradiance, *room(u, kinked), nodes=5, fine=120, radiance=sent)


@case
def flatland_weighted_irradiance(u, kinked):
    def weight(a):
        return jnp.exp(-0.5 * ((a - u[7]) / 0.3) ** 2)

    return _asked(flatland.weighted_irradiance, *room(u, kinked), nodes=5, fine=120, weight=weight)


class SplitSky(eqx.Module):
    """The light of a sky with its kink told, so that it is cut there."""

    u: Array
    kinked: Array

    def __call__(self, a):
        """Radiance from a direction."""
        return light(self.u, self.kinked)(a)

    @property
    def breaks(self):
        """The kink."""
        return 2.0 * self.u[7:8] - 1.0


def _derived(u, kinked) -> Any:
    """Derivatives and their errors, and the truth, which knows of the kink."""
    scene, at = room(u, kinked)
    split = eqx.tree_at(lambda s: s.environment, scene, SplitSky(u, kinked))
    ask = partial(flatland.derivatives, flatland.irradiance, freedoms=("x", "n"))
    return ask(scene, at, nodes=5, with_error=True), ask(split, at, nodes=40)


@case
def flatland_derivatives(u, kinked):
    return _derived(u, 0.0 * kinked)


@case
def flatland_gradient(u, kinked):
    (value, error), truth = _derived(u, kinked)
    return (value.gradient, error.gradient), truth.gradient


def hessians_behind_kinks(rng):
    """Second derivatives of light with kinks that nobody declared, whose errors do not hold."""
    u = jnp.asarray(rng.uniform(size=(COUNT, 8)))
    (value, error), truth = jax.jit(jax.vmap(lambda u: _derived(u, jnp.ones(()))))(u)
    return value.hessian, error.hessian, truth.hessian


@case
def flatland_mirror_irradiance(u, kinked):
    glass = primitive(Segments((1.5, 0.0), (1.6, 3.0)), mirror=0.8)
    scene = Scene.of(glass, environment=light(u, kinked))
    return _asked(
        flatland.mirror_irradiance, scene, Receiver((u[4], 0.0), 0.2 * u[0]),
        nodes=4, fine=120, mirrors=(0,),
    )  # fmt: skip


@case
def flatland_reflected_radiance(u, kinked):
    def lobe(w, o):
        return jnp.exp(-0.5 * ((w + o) / 0.3) ** 2)

    return _asked(
        flatland.reflected_radiance, *room(u, kinked), nodes=5, fine=120, out=u[7], brdf=lobe
    )


@case
def flatland_arc_length_integral(u, kinked):
    return _asked(arc_length_integral, *room(u, kinked), nodes=5, fine=120)


@case
def flatland_incident_flux(u, kinked):
    floor = primitive(Segments((-1.0, 0.0), (1.0 + u[4], 0.0)))
    lamp = primitive(Segments((1.0 + u[0], 2.0), (u[1], 1.0 + u[2])), emission=1.0)
    ball = primitive(Circles((-1.0 + 2.0 * u[2], 0.5), 0.2 * kinked + 1e-3))
    scene = Scene.of(floor, lamp, ball)
    ask = partial(flatland.incident_flux, scene, 0)
    return ask(nodes=6, with_error=True), ask(nodes=150)


def radiosity(rng):
    walls = primitive(flatland.polyline([(2.0, 0.0), (0.0, 0.0), (0.0, 1.5)]), albedo=0.7)
    lamp = primitive(Segments((1.0, 1.2), (0.4, 1.0)), emission=1.0)
    scene = Scene.of(walls, lamp)
    solution, error = solve_radiosity(scene, fineness=Discretization(5, 1e-3), with_error=True)
    fine = solve_radiosity(scene, fineness=Discretization(11, 1e-8))
    return solution.E, error, _interpolated(fine, solution.panels)


def _interpolated(fine, panels):
    """What a fine solution says at the Gauss nodes of coarse panels, by its own polynomials."""
    node, _ = np.polynomial.legendre.leggauss(panels.count)
    own, _ = np.polynomial.legendre.leggauss(fine.panels.count)
    shapes, sides, ends = (
        np.asarray(a) for a in (fine.panels.shape, fine.panels.side, fine.panels.ends)
    )
    E, found = np.asarray(fine.E), np.empty((len(panels.ends), panels.count))
    for k, (a, b) in enumerate(np.asarray(panels.ends)):
        same = (shapes == int(panels.shape[k])) & (sides == int(panels.side[k]))
        for j, s in enumerate(0.5 * (a + b + (b - a) * node)):
            (on,) = np.flatnonzero(same & (ends[:, 0] <= s) & (s < ends[:, 1]))
            first, last = ends[on]
            places = 0.5 * (first + last + (last - first) * own)
            found[k, j] = scipy.interpolate.barycentric_interpolate(places, E[on], s)
    return found


CASES["flatland_radiosity"] = radiosity


# --- space ---------------------------------------------------------------------------------------


def balls(u):
    """An ellipsoid and a ball, one of which may hide a part of the other, and a receiver below."""
    one = space.ellipsoid((u[0] - 0.5, u[1] - 0.5, 1.5), jnp.diag(0.2 + jnp.stack(u[:3])))
    two = space.sphere((u[3] - 0.5, u[4] - 0.5, 4.0), 0.5 + u[5])
    scene = space.Scene.of(
        space.primitive(one, emission=0.5), space.primitive(two, emission=2.0), environment=1.0
    )
    return scene, space.receiver((u[6] - 0.5, 0.0, 0.0))


@case
def space_irradiance(u, kinked):
    return _asked(space.irradiance, *balls(u), nodes=3, fine=64)


@case
def space_net_visibility(u, kinked):
    return _asked(space.net_visibility, *balls(u), nodes=3, fine=48)


@case
def space_vector_irradiance(u, kinked):
    return _asked(space.vector_irradiance, *balls(u), nodes=3, fine=48)


@case
def space_boundary_gradient(u, kinked):
    return _asked(
        space.boundary_gradient, *balls(u), nodes=6, fine=300,
        radiance=lambda index, w: jnp.where(index < 0, light(u, kinked)(w[0]), 2.0),
    )  # fmt: skip


@case
def space_visibility_by_azimuth(u, kinked):
    return _asked(visibility_by_azimuth, *balls(u), nodes=4, fine=24, most=16)


@case
def space_irradiance_by_azimuth(u, kinked):
    return _asked(irradiance_by_azimuth, *balls(u), nodes=4, fine=24, most=16)


@case
def space_transport_by_azimuth(u, kinked):
    def lit(at, w):
        return w[2] * light(u, kinked)(w[0])

    found = transport_by_azimuth(
        *balls(u), transport=lit, nodes=4, inner=4, most=16, with_error=True
    )
    return found, transport_by_azimuth(*balls(u), transport=lit, nodes=24, inner=30, most=16)


# --- fields and spectra --------------------------------------------------------------------------


def field(u, kinked):
    """Light over (x, theta) that depends on both."""
    return Function(lambda x, theta: light(u, kinked)(theta + u[0] * x), FLATLAND)


def _pair(make, coarse, fine, *where, jets=False):
    """An approximation of a portrait, and the same of a finer one."""
    ask = (lambda p: p.jets) if jets else (lambda p: p)
    return ask(make(coarse))(*where, with_error=True), ask(make(fine))(*where)


@case
def integrate(u, kinked):
    def make(n):
        return Integrate("theta", -1.0 - u[1], 1.0, n)(field(u, kinked))

    return _pair(make, 7, 500, u[2])


@case
def integrate_jet(u, kinked):
    def make(n):
        return Integrate("theta", -1.0, 1.0, n)(field(u, 0.0 * kinked))

    return _pair(make, 4, 60, u[2], jets=True)


@case
def convolve(u, kinked):
    lobe = GaussianProfile(0.1 + 0.2 * u[1], "theta", FLATLAND)

    def make(n):
        return Convolve(lobe, nodes=n)(field(u, kinked))

    return _pair(make, 15, 300, u[2], u[3])


@case
def reflected_field(u, kinked):
    surface = Surface(Function(lambda x, theta: u[1] * x, FLATLAND), (glossy(0.1 + 0.1 * u[2]),))

    def make(n):
        return surface.reflect(field(u, kinked), nodes=n)

    return _pair(make, 15, 300, u[3], u[4])


@case
def zonal(u, kinked):
    def f(w):
        return light(u, kinked)(w[0])

    w = jnp.stack([jnp.cos(u[0]), jnp.sin(u[0]), 0.0 * u[0]])
    kernel = VonMisesFisher(2.0 + 6.0 * u[1])
    return Zonal(kernel, 6, 8).value(f, w, with_error=True), Zonal(kernel, 60, 90).value(f, w)


@case
def spectrum_by_a_window(u, kinked):
    X = Frame(("x",))
    bell = Separable([0.2 * u[0]], (GaussianProfile(0.3 + 0.2 * u[1], "x", X),)).spectrum()
    factor = Function(lambda x: light(u, 0.0)(2.0 * x), X)

    def make(n):
        return Multiply(factor, Grid.spanning((n,), (1.5,)))(bell)

    def exact(Omega):
        return sum(
            a * bell(Omega - b)
            for a, b in (
                (1.5, 0.0),
                (0.5 * jnp.exp(6.0j * u[6]), (1.0 + 3.0 * u[5]) / jnp.pi),
                (0.5 * jnp.exp(-6.0j * u[6]), -(1.0 + 3.0 * u[5]) / jnp.pi),
            )
        )

    return make(24)(u[2], with_error=True), exact(u[2])


@case
def spectrum_of_samples(u, kinked):
    X = Frame(("x",))
    smooth = Gaussian([0.3 * u[0]], [[4.0 + 9.0 * u[1]]], frame=X)
    grid = Grid.spanning((12,), (1.2,))
    return SampledSpectrum.of(smooth, grid)(u[2], with_error=True), smooth.spectrum()(u[2])


@case
def shadow_spectrum(u, kinked):
    F = gaussian((0.1 * u[0], 0.0), (0.5, 0.2 + u[1]), frame=TWO_PLANES).spectrum()
    lamp = Separable([u[2]], (GaussianProfile(0.3 + u[3], "y", PLANE),)).spectrum()

    def make(n):
        return ShadowSpectrum(F, lamp, 6.0, n)

    return _pair(make, 12, 400, u[4])


# --- visibility, shadows, records ----------------------------------------------------------------


def blocked(u):
    """A blocker of half-width 1/4 that moves with the receiver."""
    middle = u[1] - 0.5
    return autodiff_edges(
        lambda p: (jnp.stack([middle - 0.25 - p[0]]), jnp.stack([middle + 0.25 - p[0]])),
        jnp.zeros(2),
    )


@case
def shading(u, kinked):
    def T(p, w):
        return jnp.cos(w) * light(u, kinked)(w) * jnp.exp(-((w - p[1]) ** 2))

    ask = partial(shading_derivatives, T, jnp.zeros(2), blocked(u))
    return ask(nodes=6, with_error=True), ask(nodes=150)


@case
def derivative_by_parts(u, kinked):
    L, rho = lambda x, w: light(u, kinked)(w), lambda a: jnp.exp(-2.0 * a * a)
    ask = partial(angular_derivative_by_parts, L, rho, 0.0, u[2], blocked(u))
    return ask(nodes=6, with_error=True), ask(nodes=150)


@case
def irradiance_behind_a_plane(u, kinked):
    veil = Function(
        lambda y: 0.5 + 0.5 * jnp.sin(9.0 * y + u[0]) + kinked * jnp.abs(y - u[1]), PLANE
    )
    f = planar_blocker(veil, 0.5)
    lamp = BoxProfile(0.5, "y", PLANE)

    def make(n):
        return shadow_irradiance(f, lamp, 1.0, -0.5, 0.5, "exact", n)

    return _pair(make, 4, 300, u[2])


@case
def factored_form_factor(u, kinked):
    lamp = Function(lambda y: 1.1 + jnp.sin(9.0 * y + u[0]) + kinked * jnp.abs(y - u[1]), PLANE)

    def make(n):
        return mean_form_factor(lamp, 0.5 + u[3], -0.5, 0.5, n)

    return _pair(make, 4, 300, u[2])


@case
def bound_of_factoring(u, kinked):
    ask = partial(factoring_bound, Constant(1.0, PLANE), 0.5 + u[0], -0.5, 0.5, u[1:2])
    return ask(nodes=20, with_error=True), ask(nodes=2000)


@case
def true_error_of_records(u, kinked):
    def E(x):
        return jnp.sin(4.0 * x[0] + u[0]) + kinked * jnp.abs(x[0] - 0.1 * u[1])

    record = Candidates.on_line(u[2:3], jnp.stack([jnp.stack([E(u[2:3]), u[3]])]))
    ask = partial(true_error, E, record, circular_regions(0.1 + u[4:5], 0.01, 2.0))
    return ask(nodes=6, with_error=True), ask(nodes=500)


def k_nearest(rng):
    found = []
    for _ in range(10):
        a, k = rng.uniform(0.2, 3.0), int(rng.integers(3, 30))

        def even(x, a=a):
            return np.clip(x, 0.0, 1.0) ** a

        ask = partial(expected_k_nearest, even, rng.uniform(size=10), k, 1000)
        found.append((*ask(nodes=12, with_error=True), ask(nodes=200)))
    return tuple(zip(*found, strict=True))


CASES["density_of_the_k_nearest"] = k_nearest


def main() -> None:
    """Prints the table."""
    import time

    import firstorder.session

    firstorder.session.start()
    print(f"{'':34} bound   ratio  clear   size  seconds")
    for name in sys.argv[1:] or CASES:
        start = time.perf_counter()
        m = measured(name)
        took = time.perf_counter() - start
        print(f"{name:34} {m.bound:6.4f} {m.ratio:6.2f} {m.clear:6.2f} {m.size:6d} {took:6.1f}")


if __name__ == "__main__":
    main()
