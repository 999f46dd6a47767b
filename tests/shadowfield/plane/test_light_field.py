import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder import shadowfield
from firstorder.checks.tolerance import fitted_order, rounding
from firstorder.fields import Affine, Bars, BoxProfile, GaussianProfile
from firstorder.flatland import Receiver, Scene, Segments, irradiance, primitive
from firstorder.shadowfield import (
    PLANE,
    FormFactor,
    factoring_bound,
    mean_form_factor,
    planar_blocker,
    planar_blockers,
    shadow_irradiance,
    to_two_planes,
)
from firstorder.shadowfield.plane import light_field

D1, DEPTHS = 1.3, (0.4, 0.7)
BARS = (((-0.25, 0.05), (0.2, 0.3)), ((-0.1, 0.12),))  # opaque strips on each plane
LOW, HIGH = -0.4, 0.6
X = np.linspace(-1.1, 1.2, 23)


def strips(bars):
    places = np.sort(np.ravel(bars))
    return Bars(Affine([1.0], 0.0, PLANE), places, np.arange(places.size + 1) % 2 == 0)


def blocked():
    return planar_blockers([strips(b) for b in BARS], DEPTHS)


def visible(x, y):
    """Follow the ray from y on the light to x on the receiver, plane by plane."""
    passed = np.ones(np.broadcast(x, y).shape)
    for bars, d2 in zip(BARS, DEPTHS, strict=True):
        u = y + (x - y) * d2 / D1
        for a, b in bars:
            passed = np.where((u > a) & (u < b), 0.0, passed)
    return passed


def seen_length(x, low=LOW, high=HIGH):
    """Length of the light that is seen: the shadows of all strips on it, united by hand."""
    shadows = []
    for bars, d2 in zip(BARS, DEPTHS, strict=True):
        for a, b in bars:
            ends = [np.clip((u - x * d2 / D1) / (1.0 - d2 / D1), low, high) for u in (a, b)]
            shadows.append(ends)
    hidden, reach = 0.0, low
    for a, b in sorted(shadows):
        hidden += max(0.0, b - max(a, reach))
        reach = max(reach, b)
    return high - low - hidden


UNIFORM = Bars(Affine([1.0], 0.0, PLANE), [LOW, HIGH], [0.0, 1.0, 0.0])


@pytest.fixture(scope="module")
def profile():
    h = shadow_irradiance(blocked(), UNIFORM, D1, LOW, HIGH, nodes=2)
    return jax.jit(lambda x: jax.vmap(lambda t: h.jet(t[None]))(x))


@pytest.mark.smoke
def test_both_names_of_a_ray_see_the_same():
    y, v = np.linspace(-0.4013, 0.5, 31)[:, None], np.linspace(-1.0017, 1.0, 29)
    truth = visible(y + D1 * v, y)
    np.testing.assert_array_equal(blocked()(y, v), truth)
    np.testing.assert_array_equal(to_two_planes(D1)(blocked())(y + D1 * v, y), truth)


def test_the_jacobian_of_the_names_is_the_distance():
    M, slope = to_two_planes(D1).M, np.array([[1.0, D1], [1.0, 0.0]])  # (y + d1 v, y) over (y, v)
    np.testing.assert_allclose(M @ slope, np.eye(2), rtol=0.0, atol=1e-15)
    assert abs(abs(np.linalg.det(M)) - 1.0 / D1) < 1e-15
    f = to_two_planes(D1)(blocked())
    np.testing.assert_allclose(f(0.1 + 0.3 * D1, 0.1), blocked()(0.1, 0.3), rtol=0.0, atol=0.0)


@pytest.mark.smoke
def test_the_shadow_is_the_visible_length(profile):
    truth = [seen_length(x) for x in X]
    np.testing.assert_allclose(profile(X).value, truth, rtol=0.0, atol=rounding(100))


def test_its_slope_holds_the_boundary_terms(profile):
    """Between kinks the visible length is linear: differences of it are exact."""
    inside = X + 0.0123
    step = 1e-4
    slope = [(seen_length(x + step) - seen_length(x - step)) / (2 * step) for x in inside]
    np.testing.assert_allclose(profile(inside).gradient[:, 0], slope, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(profile(inside).hessian, 0.0, rtol=0.0, atol=1e-9)


def midpoints(n=200000):
    return LOW + (HIGH - LOW) * (np.arange(n) + 0.5) / n, (HIGH - LOW) / n


def kernel(x, y):
    """Cosines and distance, from the geometry: both angles are that to the vertical."""
    r = np.hypot(x - y, D1)
    return (D1 / r) ** 2 / r


@pytest.mark.parametrize("form", ["omitted", "factored", "exact"])
def test_every_form_of_the_irradiance_is_its_integral(form):
    bell = GaussianProfile(0.3, "y", PLANE)
    h = jax.jit(lambda x: shadow_irradiance(blocked(), bell, D1, LOW, HIGH, form)(x))(X[::4])
    y, step = midpoints()
    light = np.exp(-0.5 * (y / 0.3) ** 2) / (0.3 * np.sqrt(2 * np.pi))
    for x, found in zip(X[::4], h, strict=True):
        r = {"omitted": 1.0, "exact": kernel(x, y)}.get(
            form, np.sum(kernel(x, y) * light) / np.sum(light)
        )
        # A midpoint beside an edge is wrong by half a step: six edges.
        assert abs(found - np.sum(r * visible(x, y) * light) * step) < 10 * step


def test_the_exact_form_is_the_irradiance_of_the_scene():
    """Another route: silhouettes and sines of angles, of the same strips as a flatland scene."""
    ends = [(a, b, D1 - d) for bars, d in zip(BARS, DEPTHS, strict=True) for a, b in bars]
    a, b, height = np.array(ends).T
    strips_ = Segments(np.stack([a, height], -1), np.stack([b, height], -1))
    lamp = primitive(Segments((HIGH, D1), (LOW, D1)), emission=1.0)
    scene = Scene.of(primitive(strips_), lamp)
    truth = jax.jit(jax.vmap(lambda x: irradiance(scene, Receiver(jnp.stack([x, 0.0]), 0.0))))(X)
    h = jax.jit(lambda x: shadow_irradiance(blocked(), UNIFORM, D1, LOW, HIGH, "exact", 24)(x))(X)
    np.testing.assert_allclose(h, truth, rtol=0.0, atol=1e-12)


def test_pulling_the_form_factor_out_errs_by_no_more_than_the_bound():
    forms = [
        jax.jit(lambda x, form=form: shadow_irradiance(blocked(), UNIFORM, D1, LOW, HIGH, form)(x))(
            X
        )
        for form in ("factored", "exact")
    ]
    error = np.abs(forms[0] - forms[1])
    bound = jax.jit(lambda x: factoring_bound(UNIFORM, D1, LOW, HIGH, x))(X)
    assert np.all(error <= bound + 1e-5)
    assert np.max(error) > 0.02 * np.max(forms[1])  # a percent of the light, and more


def test_the_bound_is_reached_by_the_worst_blocker():
    x = 0.9
    y, step = midpoints()
    K = kernel(x, y)
    worst = np.sum(np.where(np.mean(K) < K, K - np.mean(K), 0.0)) * step
    bound = jax.jit(lambda x: factoring_bound(UNIFORM, D1, LOW, HIGH, x))(x)
    assert abs(worst - bound) < 1e-5 * worst


@pytest.mark.parametrize(("x", "order"), [(0.0, 2.0), (1.0, 1.0)])
def test_the_relative_error_falls_with_the_size_of_the_light(x, order):
    sizes = np.array([0.2, 0.1, 0.05]) * D1

    @jax.jit
    def relative(a):
        light = BoxProfile(a, "y", PLANE)
        whole = 2 * a * mean_form_factor(light, D1, -a, a)(x)
        return factoring_bound(light, D1, -a, a, x) / whole

    errors = [float(relative(a)) for a in sizes]
    assert abs(fitted_order(sizes, errors) - order) < 0.05


def test_an_endless_light_gives_two():
    y = np.linspace(-400.0, 400.0, 400001)
    assert abs(np.sum(FormFactor(D1)(0.3, y)) * (y[1] - y[0]) - 2.0) < 1e-4


FAULTS = {
    "the receiver's side of the ray": lambda d1: _move([[0.0, 1.0], [1.0 / d1, 1.0 / d1]]),
    "no shear": lambda d1: _move([[0.0, 1.0], [1.0 / d1, 0.0]]),
    "planes exchanged": lambda d1: _move([[1.0, 0.0], [-1.0 / d1, 1.0 / d1]]),
}


def _move(M):
    from firstorder.laws import Move

    return Move(M, to=shadowfield.TWO_PLANES)


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_in_the_names_of_rays_shows(fault, monkeypatch):
    monkeypatch.setattr(light_field, "to_two_planes", FAULTS[fault])
    h = jax.jit(lambda x: shadow_irradiance(blocked(), UNIFORM, D1, LOW, HIGH, nodes=2)(x))(X)
    assert np.all(np.isfinite(h))
    assert np.max(np.abs(h - np.array([seen_length(x) for x in X]))) > 1e-2


def test_a_fault_in_the_form_factor_shows(monkeypatch):
    class Fewer(FormFactor):
        def at(self, u):
            return self.d1 / ((u[0] - u[1]) ** 2 + self.d1**2)  # one cosine short

    monkeypatch.setattr(light_field, "FormFactor", Fewer)
    y, step = midpoints(2000)
    h = jax.jit(lambda x: shadow_irradiance(blocked(), UNIFORM, D1, LOW, HIGH, "exact")(x))(0.5)
    assert abs(h - np.sum(kernel(0.5, y) * visible(0.5, y)) * step) > 10 * step


@pytest.mark.smoke
def test_bad_input_is_one_sentence():
    g = strips(BARS[0])
    with pytest.raises(ValueError, match=r"^Argument `d2` must be positive, but is 0.0.$"):
        planar_blocker(g, 0.0)
    with pytest.raises(ValueError, match=r"^Argument `d1` must be positive, but is -1.0.$"):
        to_two_planes(-1.0)
    with pytest.raises(ValueError, match="must have 1 entries"):
        planar_blockers([g], [0.1, 0.2])
    with pytest.raises(ValueError, match="omitted, factored or exact"):
        shadow_irradiance(planar_blocker(g, 0.5), UNIFORM, 1.0, LOW, HIGH, "none")
    assert np.isnan(jax.jit(lambda d: planar_blocker(g, d)(0.0, 0.0))(-1.0))


def test_the_depths_are_differentiable():
    """Slide a plane: the visible length changes as its shadow's ends do."""

    def h(d2):
        f = planar_blocker(strips(((-0.1, 0.12),)), d2)
        return shadow_irradiance(f, UNIFORM, D1, LOW, HIGH, nodes=2)(0.2)

    def hidden(d2):
        return (0.12 + 0.1) / (1.0 - d2 / D1)

    step = 1e-5
    truth = -(hidden(0.5 + step) - hidden(0.5 - step)) / (2 * step)
    assert abs(jax.jit(jax.grad(h))(0.5) - truth) < 1e-8


def test_single_precision_is_enough():
    with jax.enable_x64(False):
        g = Bars(Affine([1.0], 0.0, PLANE), [0.0], [0.0, 1.0])
        light = BoxProfile(0.5, "y", PLANE)
        h = shadow_irradiance(planar_blocker(g, 0.5), light, 1.0, -0.5, 0.5, "exact", nodes=12)
        value, slope = jax.jit(lambda x: (h(x), jax.grad(lambda x: h(x))(x)))(jnp.float32(0.2))
    assert value.dtype == slope.dtype == jnp.float32
    # Light is seen from -0.2 to 0.5: the primitive of K is a sine.
    ends = np.array([-0.2, 0.5]) - 0.2
    assert abs(value - np.diff(ends / np.hypot(ends, 1.0))[0]) < 1e-6
    assert np.isfinite(slope)


def test_a_light_at_no_distance_has_no_form_factor():
    with pytest.raises(ValueError, match=r"^Argument `d1` must be positive, but is -2.0.$"):
        FormFactor(-2.0)
    assert np.isnan(jax.jit(lambda d1: FormFactor(d1)(0.5, 0.5))(-2.0))
