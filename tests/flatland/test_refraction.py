"""Light through glass: photons counted, power kept, caustics, the first-order limit; faults."""

import itertools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from derivations.flatland import refraction as brute
from firstorder.flatland import (
    Arcs,
    Circles,
    Curves,
    Scene,
    Segments,
    primitive,
    refraction,
)
from firstorder.flatland.refraction import (
    Beam,
    Caustic,
    PointSource,
    _refracted,
    fresnel_reflectance,
    rainbow_incidence,
    through_body,
    trace_path,
)
from firstorder.numerics._quadrature import gauss_legendre
from firstorder.transport import Fresnel

EDGES = np.linspace(0.36, 0.64, 29)  # of bins on the screen, by its parameter
N = 400_000

folds = eqx.filter_jit(Caustic.folds)
irradiance = eqx.filter_jit(Caustic.irradiance)


def on_screen(p, u, height=1.25):
    """Parameter on the screen of `brute.glass`, which runs from x = 2 to x = -2."""
    x = p[:, 0] + (height - p[:, 1]) / u[:, 1] * u[:, 0]
    return np.where(u[:, 1] > 0.0, (2.0 - x) / 4.0, -1.0)


def exact_flux(lens, edges):
    """Flux into bins: Gauss-Legendre in pieces that end at folds, with `x = fold +- t^2`."""
    _, places, real = folds(lens)
    places = np.asarray(places)[np.asarray(real)]
    t, w = gauss_legendre(12)
    nodes, weights, bins = [], [], []
    for k, (a, b) in enumerate(itertools.pairwise(edges)):
        inner = np.sort(places[(places > a) & (places < b)])
        ends = [a, *inner, b]
        for low, high in itertools.pairwise(ends):
            # sin^2 takes the root from both ends.
            z = 0.25 * np.pi * (t + 1.0)
            nodes.append(low + (high - low) * np.sin(z) ** 2)
            weights.append(0.25 * np.pi * w * (high - low) * np.sin(2.0 * z))
            bins.append(np.full(len(t), k))
    E = irradiance(lens, jnp.asarray(np.concatenate(nodes)))
    length = 4.0
    return np.bincount(np.concatenate(bins), np.concatenate(weights) * np.asarray(E) * length)


@pytest.fixture(scope="module")
def flux():
    return exact_flux(brute.glass(), EDGES)


def test_photons_are_where_the_exact_irradiance_says(flux):
    """z-test in each bin: random rays, traced in NumPy, weighted with what Fresnel lets through."""
    b = np.random.default_rng(1).uniform(-0.999, 0.999, N)
    p, u, share = brute.photons(*brute.parallel(b))
    which = np.digitize(on_screen(p, u), EDGES) - 1
    inside = (which >= 0) & (which < len(flux))
    total = np.bincount(which[inside], share[inside], minlength=len(flux))
    square = np.bincount(which[inside], share[inside] ** 2, minlength=len(flux))
    scale = 1.998 / N
    deviation = scale * np.sqrt(square - total**2 / N)
    z = (scale * total - flux) / np.maximum(deviation, 1e-12)
    assert np.abs(z).max() < 4.0  # 28 bins: one in 600
    assert np.sum(z**2) < 28 + 5.0 * np.sqrt(2.0 * 28)
    assert flux.max() > 3.0 * flux.min() > 0.0  # and there is a caustic to be found


def test_strata_of_rays_agree_far_better(flux):
    b = 0.999 * (2.0 * (np.arange(N) + 0.5) / N - 1.0)
    p, u, share = brute.photons(*brute.parallel(b))
    which = np.digitize(on_screen(p, u), EDGES) - 1
    inside = (which >= 0) & (which < len(flux))
    total = np.bincount(which[inside], share[inside], minlength=len(flux)) * 1.998 / N
    # A bin's edges cut strata: a few of N rays, more where they are dense.
    np.testing.assert_allclose(total, flux, rtol=0.0, atol=20.0 * 1.998 / N)


def test_disc_keeps_all_power():
    """Over all rays and orders: what is reflected and what comes out adds up to what came."""
    scene = brute.glass().scene
    t, w = gauss_legendre(24)
    light = Beam((0.0, -3.0), 0.0)

    def share(q, inside):
        return trace_path(scene, through_body(1, inside=inside), *light.ray(q)).share

    def shares(q):
        """At once, and after each number of reflections inside."""
        at_once = trace_path(scene, ((1, "back"),), *light.ray(q)).share
        return at_once, [share(q, inside) for inside in range(4)]

    reflected, parts = jax.tree.map(np.asarray, jax.jit(jax.vmap(shares))(0.9 * t))
    left = (1.0 - reflected) * reflected**4
    total = float(np.sum(w * (reflected + sum(parts) + left)))
    assert total == pytest.approx(2.0, abs=1e-12)


def test_folds_are_where_the_screen_meets_the_caustic():
    lens = brute.glass()
    q, places, real = folds(lens)
    assert int(real.sum()) == 2
    for ray, s in zip(q[real], places[real], strict=True):
        point, _ = lens.envelope(ray)
        np.testing.assert_allclose(
            np.asarray(point), [2.0 - 4.0 * float(s), 1.25], rtol=0.0, atol=1e-9
        )


def test_irradiance_beside_a_fold_grows_as_the_root_says():
    lens = brute.glass()
    _, places, real = folds(lens)
    fold = float(places[np.flatnonzero(real)[0]])
    inward = np.sign(0.5 - fold)
    d = np.array([1e-6, 4e-6])
    near = jnp.asarray([fold + side * inward * x for side in (1.0, -1.0) for x in d])
    E = np.asarray(irradiance(lens, near)).tolist()
    bright, dark = (E[:2], E[2:]) if E[0] > E[2] else (E[2:], E[:2])
    assert (bright[0] - dark[0]) / (bright[1] - dark[1]) == pytest.approx(2.0, rel=2e-3)


def test_single_precision_beside_double_does_no_harm():
    """A ray in singles through a scene in doubles: as exact as the ray."""
    lens = Caustic(thin_lens(), PointSource((0.0, -8.0)), through_body(1, 2), 0, -0.03, 0.03)
    double, single = lens.arrive(0.01), lens.arrive(jnp.float32(0.01))
    assert single.position.dtype == double.position.dtype
    # 6e-8 of a direction, over 12 m and two faces.
    np.testing.assert_allclose(
        np.asarray(single.position), np.asarray(double.position), rtol=0.0, atol=1e-5
    )
    assert np.all(np.isfinite(np.asarray(lens.envelope(jnp.float32(0.01))[0])))


def test_derivative_is_that_of_differences():
    """Autodiff by the receiver's place and by the index, against differences of the exact E."""
    lens = brute.glass()
    h = 1e-4

    def E(s, index):
        other = eqx.tree_at(
            lambda lens: lens.scene.material.ior, lens, jnp.asarray([0.0, 1.0]) * index
        )
        return other.irradiance(s)

    # All five places in one program.
    s, index = np.array([0.47, 1.5])[:, None] + h * np.array([[0, 1, -1, 0, 0], [0, 0, 0, 1, -1]])
    f, slopes = jax.jit(jax.vmap(jax.value_and_grad(E, (0, 1))))(s, index)
    numeric = np.array([f[1] - f[2], f[3] - f[4]]) / (2 * h)
    np.testing.assert_allclose([slope[0] for slope in slopes], numeric, rtol=1e-4)


def thin_lens(n=1.5, radius=4.0, half=0.3):
    """Two arcs that meet at the ends, normals outward; and a screen."""
    angle = np.arcsin(half / radius)
    low = Arcs((0.0, radius * np.cos(angle)), radius, np.pi + angle, -2.0 * angle)
    high = Arcs((0.0, -radius * np.cos(angle)), radius, angle, -2.0 * angle)
    screen = Segments((1.0, 3.9), (-1.0, 3.9))
    return Scene.of(primitive(screen), primitive(low, ior=n), primitive(high, ior=n))


def test_a_thin_lens_has_the_focal_length_of_the_lens_maker():
    """`1 / f = (n - 1) 2 / R` for rays near the axis, to the lens' thickness."""
    lens = Caustic(thin_lens(), Beam((0.0, -1.0), 0.0), through_body(1, 2), 0, -0.28, 0.28)
    focus, _ = lens.envelope(1e-4)
    assert float(focus[1]) == pytest.approx(4.0, abs=0.02)
    # A point light at twice the focal length is imaged there.
    there = Caustic(thin_lens(), PointSource((0.0, -8.0)), through_body(1, 2), 0, -0.03, 0.03)
    image, _ = there.envelope(1e-5)
    assert float(image[1]) == pytest.approx(8.0, abs=0.05)


def test_a_blocker_on_the_way_stops_a_ray():
    blocked = Scene.of(
        primitive(Segments((2.0, 1.9), (-2.0, 1.9))),
        primitive(Segments((0.2, 1.4), (-0.2, 1.4))),
        primitive(Circles((0.0, 0.0), 1.0), ior=1.5),
    )
    lens = Caustic(blocked, Beam((0.0, -3.0), 0.0), through_body(2), 0, -0.99, 0.99)
    assert not bool(lens.arrive(0.0).ok)
    assert float(lens.arrive(0.0).share) == 0.0


def test_reflectance_is_that_of_the_interface_event_with_total_reflection():
    theta = np.linspace(0.0, 1.5, 7)
    for eta in (1.5, 1.0 / 1.5):
        expected = [float(Fresnel(eta)(0.0, t)) for t in theta]
        np.testing.assert_allclose(
            fresnel_reflectance(eta, np.cos(theta)), expected, rtol=0.0, atol=1e-14
        )
    u, ok = _refracted(
        jnp.array([np.sin(1.0), np.cos(1.0)]), jnp.array([0.0, -1.0]), jnp.asarray(0.5)
    )
    assert not bool(ok)
    assert np.all(np.isfinite(u))


def test_bad_input_is_refused():
    with pytest.raises(ValueError, match="must say 'through' or 'back'"):
        trace_path(brute.glass().scene, ((1, "around"),), jnp.zeros(2), jnp.array([0.0, 1.0]))
    with pytest.raises(ValueError, match=r"must lie in \(1, 2\), but is 2.4"):
        rainbow_incidence(2.4, 1)
    with pytest.raises(ValueError, match="`power` must not be negative"):
        PointSource((0.0, 0.0), -1.0)


FAULTS = {
    "forget Fresnel": ("fresnel_reflectance", lambda eta, c: 0.0 * jnp.asarray(c)),
    "index upside down": ("_refracted", lambda u, n, eta: right_refracted(u, n, 1.0 / eta)),
    "s polarisation only": (
        "fresnel_reflectance",
        lambda eta, c: ((c - jnp.sqrt(eta**2 - 1 + c**2)) / (c + jnp.sqrt(eta**2 - 1 + c**2))) ** 2,
    ),
}
right_refracted = refraction._refracted


@pytest.mark.parametrize("name", FAULTS)
def test_fault_is_noticed(name, monkeypatch):
    """Directions and shares of single rays against vectors in NumPy."""

    def error():
        lens = brute.glass()
        q = np.array([0.2, 0.5, 0.7])
        _, u, share = brute.photons(*brute.parallel(q))
        ours = jax.jit(jax.vmap(lambda q: trace_path(lens.scene, lens.path, *lens.light.ray(q))))(q)
        return max(np.abs(ours.along - u).max(), np.abs(ours.share - share).max())

    assert error() < 1e-13
    monkeypatch.setattr(refraction, *FAULTS[name])
    assert np.isfinite(error())
    assert error() > 1e-3


def barred(bars):
    """A beam on a floor between bars, the edges of these, and places beside each edge."""
    edges = (np.linspace(-0.45, 0.45, 2 * bars + 1)[:-1] + 0.001234).reshape(bars, 2)
    floor = primitive(Segments((-1.0, 0.0), (1.0, 0.0)))
    stops = [primitive(Segments((b, 1.0), (a, 1.0))) for a, b in edges]
    lit = Caustic(Scene.of(floor, *stops), Beam((0.0, 3.0), np.pi), (), 0, -0.5, 0.5)
    places = np.concatenate([edges.ravel() - 1e-4, edges.ravel() + 1e-4])
    return irradiance(lit, (places + 1.0) / 2.0), edges, places


@pytest.mark.parametrize("bars", [2, 5, 8])
def test_light_reaches_the_edge_of_every_shadow(bars):
    found, edges, x = barred(bars)
    dark = np.any((edges[:, :1] < x) & (x < edges[:, 1:]), 0)
    np.testing.assert_allclose(found, np.where(dark, 0.0, 1.0), rtol=0.0, atol=1e-12)


def test_more_rims_than_can_be_followed_are_no_answer():
    assert np.all(np.isnan(barred(9)[0]))


def test_more_folds_than_can_be_followed_are_no_answer():
    """A flat ellipse with waves, `(cos t, 0.2 sin t + 0.01 cos 10 t)`: ten folds and no rim."""
    cosines, sines = np.zeros((1, 11, 2)), np.zeros((1, 11, 2))
    cosines[0, 1, 0], sines[0, 1, 1], cosines[0, 10, 1] = 1.0, 0.2, 0.01
    screen = primitive(Segments((8.0, 3.0), (-8.0, 3.0)))
    scene = Scene.of(screen, primitive(Curves(cosines, sines, samples=32), ior=1.5))
    mirror = Caustic(scene, Beam((0.0, 1.0), np.pi), ((1, "back"),), 0, -0.98, 0.98, 96)
    q, places, _ = folds(mirror)
    assert np.isnan(q).all()
    assert np.isnan(places).all()


@pytest.mark.parametrize(
    "light", [lambda p: PointSource((0.0, 1.0), p), lambda p: Beam((0.0, 1.0), 0.0, p)]
)
def test_a_traced_negative_power_is_none(light):
    power = jax.jit(lambda p: light(p).power)
    assert np.isnan(power(-1.0))
    assert power(2.0) == 2.0


def test_a_path_through_a_shape_that_is_not_there_is_refused():
    floor = primitive(Segments((-1.0, 0.0), (1.0, 0.0)))
    ball = primitive(Circles((0.0, 0.9), 0.5), ior=1.5)
    ray = np.array([0.1, 3.0]), np.array([0.0, -1.0])
    with pytest.raises(ValueError, match=r"^Argument `path` must be the number of a shape, 0 to 1"):
        trace_path(Scene.of(ball, floor), through_body(7), *ray, 0)
