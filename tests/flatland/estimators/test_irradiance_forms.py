import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from derivations.flatland._scenes import built, motion
from firstorder.checks.tolerance import fitted_order, normwise
from firstorder.flatland import (
    Arcs,
    Ellipses,
    Receiver,
    Scene,
    Segments,
    derivatives_on_shape,
    irradiance,
    primitive,
    receiver,
)
from firstorder.flatland.estimators import corrected
from firstorder.flatland.estimators._irradiance_forms import (
    arc_length_estimate,
    arc_length_estimate_on_curves,
    arc_length_integral,
    arc_length_sum,
    repeated_estimate,
    stratified_estimate,
)
from firstorder.flatland.estimators.corrected import corrected_estimate
from firstorder.flatland.estimators.strata import Strata, hemicircle_strata, trace_strata
from firstorder.scene._derivatives import FLATLAND, Derivatives
from firstorder.visibility import edge_at
from tests.precision import as_dtype

# Receivers in no special position: tilted; in B in the penumbra, clear of visual events.
PLACES = {"A": ((0.35, 0.0), 0.2), "B": ((0.35, 0.0), 0.2), "disc": ((0.35, 0.02), 0.2)}
MOST = 8192


@functools.cache
def truth(name):
    return motion(name, *PLACES[name])


def errors(ours, name):
    value, gradient, hessian = truth(name)
    return np.array(
        [
            abs(float(ours.value) - value),
            normwise(ours.gradient, gradient),
            normwise(ours.hessian, hessian),
        ]
    )


def padded(where):
    """The same strata as `MOST` of them: a sample beside its own copy makes no difference."""
    copies = MOST // where.angles.shape[0]
    inner = jnp.repeat(where.borders[1:], copies)
    return Strata(
        jnp.concatenate([where.borders[:1], inner]),
        jnp.repeat(where.angles, copies),
        jnp.repeat(where.weights, copies) / copies,
    )


@functools.cache
def compiled(name):
    """All forms of one kind of scene, compiled once; the mended one before the disc only.

    `bend` and `inverse` multiply the borders of the mended form: 1, or a deliberate fault.
    """
    _, radiance = built(name)

    @jax.jit
    def run(scene, at, where, sliding, bend, inverse):
        def twin(angle, w, jump, slide=0.0):
            return edge_at(angle, inverse * w, jump, bend * slide)

        seen = trace_strata(scene, at, where=where, radiance=radiance)
        out = {"arc length": arc_length_estimate(seen), "stratified": stratified_estimate(seen)}
        if name == "disc":
            with pytest.MonkeyPatch.context() as patch:
                patch.setattr(corrected, "edge_at", twin)
                out["mended"] = corrected_estimate(
                    scene, at, samples=seen, radiance=radiance, breaks=8, sliding=sliding
                )
        return out

    return run


def all_forms(name, at, where, sliding=True, bend=1.0, inverse=1.0):
    return compiled(name)(built(name)[0], at, where, sliding, bend, inverse)


def at(name):
    return Receiver(*PLACES[name])


def sampled(name, n, key, **change):
    return all_forms(name, at(name), padded(hemicircle_strata(n, jax.random.key(key))), **change)


def orders(name, form, sizes, runs=8):
    """Fitted orders and last errors of value, gradient and Hessian: RMS over random keys."""
    found = []
    for n in sizes:
        here = [errors(sampled(name, n, k)[form], name) for k in range(runs)]
        found.append(np.sqrt(np.mean(np.square(here), 0)))
    found = np.array(found)
    return [fitted_order(np.array(sizes), found[:, k]) for k in range(3)], found[-1]


# --- the arc-length form ------------------------------------------------------------------------


@functools.cache
def exact(name):
    scene, radiance = built(name)
    return eqx.filter_jit(lambda at: arc_length_integral(scene, at, radiance=radiance))(at(name))


@pytest.mark.smoke
def test_the_arc_length_integral_is_exact_without_shadows():
    assert max(errors(exact("A"), "A")) < 1e-12


@pytest.mark.parametrize("name", ["B", "disc"])
def test_the_arc_length_form_does_not_see_shadow_edges_move(name):
    """Its value and its turn are right; its steps are off by what the edges do."""
    ours = exact(name)
    value, gradient, hessian = truth(name)
    assert abs(ours.value - value) < 1e-12
    assert abs(ours.gradient[2] - gradient[2]) < 1e-12
    assert abs(ours.hessian[2, 2] - hessian[2, 2]) < 1e-12
    assert abs(ours.gradient[0] - gradient[0]) > 0.2 * abs(gradient[0])
    assert abs(ours.hessian[0, 0] - hessian[0, 0]) > 0.1 * abs(hessian[0, 0])


def within_bars(ours, right):
    leaves = zip(*map(jax.tree.leaves, (ours.mean, ours.error, right)), strict=True)
    return max(float(np.max(np.abs(m - t) / (e + 1e-12))) for m, e, t in leaves)


def test_sampled_by_angle_it_has_that_integral_for_its_mean():
    scene, _ = built("A")
    run = jax.jit(
        lambda k: repeated_estimate(
            lambda k: arc_length_estimate(
                trace_strata(scene, at("A"), where=hemicircle_strata(32, k))
            ),
            k,
            300,
        )
    )
    assert within_bars(run(jax.random.key(1)), exact("A")) < 4.5


def test_sampled_by_arc_length_too():
    """Before the disc: on curves the visible part decides, and the limb does no harm."""
    scene, L = built("disc")
    run = jax.jit(
        lambda k: repeated_estimate(
            lambda k: arc_length_estimate_on_curves(scene, at("disc"), count=32, key=k, radiance=L),
            k,
            300,
        )
    )
    assert within_bars(run(jax.random.key(2)), exact("disc")) < 4.5


TWINS = [((1.0, 1.0), (-1.0, 1.0)), ((2.0, 1.0), (-2.0, 1.0))]  # one in the place of the other


@pytest.mark.parametrize("own_light", [True, False])
def test_of_surfaces_in_one_place_the_arc_length_form_counts_the_one_that_is_seen(own_light):
    """Two lamps, or a lamp on a wall that reflects: by hand, of `sin` at the ends."""
    lights = (1.0, 2.0) if own_light else (1.0, 0.0)
    scene = Scene.of(
        *(primitive(Segments(*ends), emission=L) for ends, L in zip(TWINS, lights, strict=True))
    )

    def sent(number, s, front, along):
        return jnp.where(number == 0, 1.0, 0.5)

    ours = arc_length_estimate_on_curves(
        scene, Receiver((0.0, 0.0), 0.0), count=1024, radiance=None if own_light else sent
    )
    near, far = np.sqrt(2.0), 4.0 / np.sqrt(5.0)
    right = 2.0 * far if own_light else near + 0.5 * (far - near)
    assert abs(ours.value - right) < 2e-3


def test_points_at_the_ends_of_shapes_count():
    """By the trapezoidal rule, whose first and last point are ends."""
    s, weights = np.linspace(0.0, 1.0, 5)[None], np.array([[0.125, 0.25, 0.25, 0.25, 0.125]])
    lamp = Scene.of(primitive(Segments((1.0, 1.0), (-1.0, 1.0)), emission=1.0))
    ours = arc_length_sum(lamp, Receiver((0.0, 0.0), 0.0), s=s, weights=weights)
    right = 2.0 * np.sum(weights / (1.0 + (1.0 - 2.0 * s) ** 2) ** 1.5)
    assert abs(ours.value - right) < 1e-14


def test_strata_of_any_measure_have_one_integral():
    right = exact("disc")
    even = jnp.linspace(-1.0, 1.0, MOST + 1)
    uneven = hemicircle_strata(0.5 * jnp.pi * (0.7 * even + 0.3 * even**3))
    for where in (hemicircle_strata(MOST), hemicircle_strata(MOST, cosine=True), uneven):
        ours = all_forms("disc", at("disc"), where)
        assert normwise(ours["arc length"].gradient, right.gradient) < 2e-3
        assert max(errors(ours["mended"], "disc")) < 1e-4


# --- the stratified form ------------------------------------------------------------------------


def test_the_stratified_form_tends_to_the_truth_before_flat_lights():
    """First order in the width, gradient and Hessian, by all three freedoms."""
    found, last = orders("B", "stratified", (64, 512, 4096))
    assert all(-1.4 < order < -0.6 for order in found)
    assert max(last) < 5e-3


def test_before_a_curved_limb_its_gradient_is_of_order_one_half():
    found, _ = orders("disc", "stratified", (128, 1024, 8192), runs=12)
    assert -0.7 < found[1] < -0.3


# --- attacks ------------------------------------------------------------------------------------


def carried(tree, angle, scale, shift):
    """A scene or receiver turned about the origin, enlarged and shifted."""
    T = scale * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])

    def move(p):
        return p @ T.T + shift

    if isinstance(tree, Receiver):
        return Receiver(move(tree.position), tree.n + angle, tree.on)
    lines, discs = tree.groups
    lines = type(lines)(move(lines.start), move(lines.end))
    discs = type(discs)(move(discs.center), scale * discs.radius)
    return eqx.tree_at(lambda s: s.groups, tree, (lines, discs))


@pytest.mark.parametrize(("angle", "scale"), [(np.pi / 2, 1.0), (-2.3, 1.0), (0.7, 40.0)])
def test_rigid_motions_and_units(angle, scale):
    """Numbers in the receiver's frame stay; k-th derivatives by steps go as `scale^-k`."""
    move = (angle, scale, np.array([0.6, -1.1]))
    scene, _ = built("disc")
    where = padded(hemicircle_strata(256))
    here = all_forms("disc", at("disc"), where)
    there = compiled("disc")(
        carried(scene, *move), carried(at("disc"), *move), where, True, 1.0, 1.0
    )
    unit = np.array([scale, scale, 1.0])
    for form in here:
        assert normwise(there[form].value, here[form].value) < 1e-9
        assert normwise(there[form].gradient * unit, here[form].gradient) < 1e-7
        rescaled = there[form].hessian * np.outer(unit, unit)
        assert normwise(rescaled, here[form].hessian) < 1e-6


def test_more_light_is_more_of_everything():
    """All forms are linear in the radiance: twice the light, twice every number."""
    seen = jax.jit(lambda: trace_strata(built("B")[0], at("B"), where=hemicircle_strata(64)))()
    twice = eqx.tree_at(lambda s: s.radiance, seen, 2.0 * seen.radiance)
    for form in (arc_length_estimate, stratified_estimate):
        for a, b in zip(jax.tree.leaves(form(twice)), jax.tree.leaves(form(seen)), strict=True):
            assert normwise(a, 2.0 * b) < 1e-12


# --- turns, and receivers that bend -------------------------------------------------------------


def test_light_at_the_horizon_is_what_the_arc_length_form_misses_when_it_turns():
    """Under an even sky nothing changes by turning: E = 2, E_nn = 0; the arc-length form says -2.

    The strata get it right because the two borders at the horizon are left out.
    """
    ground = primitive(Segments((-1.0, -1.0), (1.0, -1.0)))
    scene = Scene.of(ground, environment=lambda a: 0.0 * a + 1.0)
    seen = jax.jit(
        lambda: trace_strata(scene, Receiver((0.0, 0.0), 0.3), where=hemicircle_strata(500))
    )()
    flat, frozen = stratified_estimate(seen), arc_length_estimate(seen)
    np.testing.assert_allclose([flat.value, frozen.value], 2.0, rtol=1e-5)
    np.testing.assert_allclose(flat.hessian[2, 2], 0.0, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(frozen.hessian[2, 2], -2.0, rtol=1e-5)
    np.testing.assert_allclose(flat.gradient, 0.0, rtol=0.0, atol=1e-12)


def test_along_a_bent_receiver():
    """An ellipse, whose curvature changes, under a light: to the exact route."""
    lamp = primitive(Segments((0.8, 2.0), (-0.2, 2.0)), emission=1.0)
    above, scene = Scene.of(lamp), Scene.of(lamp, primitive(Ellipses((0.0, 0.0), (1.0, 0.6), 0.3)))

    @jax.jit
    def both(s):
        at = receiver(scene, 1, s)
        kappa, slope = jax.value_and_grad(lambda s: scene.frame(1, s).kappa)(s)
        ours = arc_length_integral(above, at).along(kappa, slope / scene.frame(1, s).speed)
        return ours, derivatives_on_shape(lambda r: irradiance(above, r), scene, 1, s)

    for s in (0.05, 0.93):
        ours, right = both(jnp.array(s))
        for a, b in zip(jax.tree.leaves(ours), jax.tree.leaves(right), strict=True):
            assert normwise(a, b) < 1e-11


def test_reading_off_a_motion():
    """By the chain rule: a quadratic function followed along a parabola-like path."""
    rng = np.random.default_rng(2)
    g, H = rng.normal(size=3), rng.normal(size=(3, 3))
    H, k, dk = H + H.T, 0.7, -0.4
    ours = Derivatives(jnp.array(1.0), jnp.asarray(g), jnp.asarray(H), FLATLAND)

    def path(s):
        """To second order: dt/ds = kappa n, dn/ds = kappa."""
        return np.array([s, k * s**2 / 2, k * s + dk * s**2 / 2])

    h = 1e-4
    f = [g @ path(s) + path(s) @ H @ path(s) / 2 for s in (-h, 0.0, h)]
    read = ours.along(k, dk)
    np.testing.assert_allclose(read.first, (f[2] - f[0]) / (2 * h), rtol=1e-6)
    np.testing.assert_allclose(read.second, (f[2] - 2 * f[1] + f[0]) / h**2, rtol=1e-5)
    assert (ours.translation().second, ours.rotation().second) == (H[0, 0], H[2, 2])


# --- error bars, degenerate input, precision ----------------------------------------------------


@pytest.mark.smoke
def test_error_bars_hold():
    """Two independent means differ by no more than their bars allow."""
    scene, _ = built("B")
    run = jax.jit(
        lambda k: repeated_estimate(
            lambda k: stratified_estimate(
                trace_strata(scene, at("B"), where=hemicircle_strata(64, k))
            ),
            k,
            200,
        )
    )
    a, b = run(jax.random.key(1)), run(jax.random.key(2))
    both = jax.tree.map(lambda x, y: np.sqrt(x**2 + y**2), a.error, b.error)
    z = jax.tree.map(lambda x, y, e: np.max(np.abs(x - y) / (e + 1e-12)), a.mean, b.mean, both)
    assert max(jax.tree.leaves(z)) < 4.5
    assert a.error.gradient[0] > 1e-4
    np.testing.assert_allclose(a.spread.value, a.error.value * np.sqrt(200.0))


def test_nothing_to_see_a_single_stratum_and_a_receiver_on_a_shape():
    """Finite everywhere, and zero where nothing is seen."""
    down = Receiver((0.0, -1.0), np.pi)
    for form in all_forms("disc", down, padded(hemicircle_strata(1))).values():
        assert all(np.all(np.asarray(leaf) == 0.0) for leaf in jax.tree.leaves(form))
    top = Receiver((0.1, 0.65), 0.0, 2)  # on the disc
    for n in (1, 2, 64):
        for form in all_forms("disc", top, padded(hemicircle_strata(n))).values():
            assert all(np.all(np.isfinite(leaf)) for leaf in jax.tree.leaves(form))


def test_a_bowl_shines_on_itself():
    """From a point of a half circle of radius R: what is seen of it is the sky of a full turn."""
    bowl = Scene.of(primitive(Arcs((0.0, 1.0), 1.0, 0.5 * np.pi, np.pi), emission=1.0))
    at = receiver(bowl, 0, 0.3)
    rim = np.array([1.0, -1.0]), np.array([1.0, 1.0])
    ways = np.stack(rim, -1) - np.asarray(at.position)
    sines = ways @ np.asarray(at.tangent) / np.linalg.norm(ways, axis=1)
    truth = 2.0 - abs(sines[0] - sines[1])
    seen = trace_strata(bowl, at, where=hemicircle_strata(2000))
    assert abs(arc_length_estimate(seen).value - truth) < 1e-5
    assert abs(arc_length_estimate_on_curves(bowl, at, count=2000).value - truth) < 1e-5
    flat = Scene.of(primitive(Segments((0.0, 0.0), (1.0, 0.3)), emission=1.0))
    on_flat = arc_length_estimate_on_curves(flat, receiver(flat, 0, 0.3), count=10)
    assert on_flat.value == 0.0


@pytest.mark.smoke
def test_single_precision():
    scene, radiance = built("disc")

    @jax.jit
    def run(scene, at, where):
        seen = trace_strata(scene, at, where=where, radiance=radiance)
        return corrected_estimate(
            scene, at, samples=seen, radiance=radiance, breaks=4
        ), stratified_estimate(seen)

    best, plain = run(*as_dtype((scene, at("disc"), hemicircle_strata(512)), jnp.float32))
    assert best.gradient.dtype == plain.hessian.dtype == jnp.float32
    assert max(errors(jax.tree.map(lambda a: np.asarray(a, float), best), "disc")) < 2e-2
    assert max(errors(jax.tree.map(lambda a: np.asarray(a, float), plain), "disc")[:2]) < 0.5


def test_bad_input_is_one_sentence():
    with pytest.raises(ValueError, match=r"^Argument `borders` must be positive, but is 0.$"):
        hemicircle_strata(0)
    with pytest.raises(ValueError, match="must ascend from -pi/2 to pi/2"):
        hemicircle_strata(np.array([-1.0, 0.0, 1.0]))
    with pytest.raises(ValueError, match="must be at least 2"):
        repeated_estimate(lambda key: None, jax.random.key(0), 1)


def test_an_arc_length_sum_refuses_what_are_not_points_of_every_shape():
    lamp, at = Scene.of(primitive(Segments((1.0, 1.0), (-1.0, 1.0)))), Receiver((0.0, 0.0), 0.0)
    rows, two = Receiver(np.zeros((3, 2)), 0.0), np.full((2, 4), 0.5)
    with pytest.raises(ValueError, match="`s` must have a row for each of 1 shapes"):
        arc_length_sum(lamp, at, s=two, weights=two)
    with pytest.raises(ValueError, match="`at` must be one receiver"):
        arc_length_sum(lamp, rows, s=two[:1], weights=two[:1])
    with pytest.raises(ValueError, match="`count` must be a positive integer"):
        arc_length_estimate_on_curves(lamp, at, count=0)


# --- deliberate faults --------------------------------------------------------------------------

FAULTS = {
    "the farther sample moves the border": lambda s: eqx.tree_at(
        lambda s: s.distance, s, jnp.maximum(s.distance, jnp.roll(s.distance, 1))
    ),
    "the wrong side of the border": lambda s: eqx.tree_at(lambda s: s.radiance, s, -s.radiance),
    "angles towards +x": lambda s: eqx.tree_at(lambda s: s.strata.borders, s, -s.strata.borders),
    "the fall-off of space": lambda s: eqx.tree_at(lambda s: s.distance, s, s.distance**2),
}


@pytest.fixture(scope="module")
def seen_in_b():
    scene, _ = built("B")
    return jax.jit(lambda: trace_strata(scene, at("B"), where=hemicircle_strata(4096)))()


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_of_the_stratified_form_are_noticed(fault, seen_in_b):
    assert errors(stratified_estimate(seen_in_b), "B")[1] < 5e-3
    error = errors(stratified_estimate(FAULTS[fault](seen_in_b)), "B")[1]
    assert np.isfinite(error)
    assert error > 0.1
