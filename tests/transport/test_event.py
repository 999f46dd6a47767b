import inspect
import operator

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.cases import light
from firstorder.conventions import FLATLAND, FLATLAND_SLOPE, Frame
from firstorder.errors import Refused
from firstorder.fields import (
    Covariance,
    Function,
    Grid,
    Spectrum,
    discrete_transform,
    gaussian,
    half_plane,
)
from firstorder.transport import (
    AngularFactor,
    Bump,
    Chain,
    Cosine,
    Curvature,
    Fresnel,
    Mirror,
    Occlusion,
    Path,
    ToSlope,
    Travel,
    half_plane_blocker,
    require_frame,
    wave,
)
from firstorder.transport.events.diffuse import diffuse
from firstorder.transport.events.incidence import Incidence, Outgoing
from firstorder.transport.events.travel import Arrival

WINDOW = Grid.spanning((128, 96), (8.0, 5.0))
U = jnp.array([0.3, -0.2])


@pytest.fixture
def path():
    """D05 Fig. 6: source, travel, blocker, travel, diffuse receiver."""
    blocker = half_plane_blocker(0.1, FLATLAND_SLOPE, 0.0, WINDOW)
    return (
        light(FLATLAND_SLOPE) >> Travel(0.6) >> blocker >> Travel(1.2) >> diffuse(0.5, 5.0, WINDOW)
    )


@pytest.mark.smoke
def test_every_step_is_exposed(path):
    assert len(path.events) == 5
    assert len(path.steps) == len(path.spectra) == len(path.covariances) == 6
    assert path.steps[0] is path.source
    assert path.light.frame.coordinates == ("x",)
    for step, event, after in zip(path.steps[:3], path.events, path.steps[1:], strict=False):
        assert event(step)(*U) == after(*U)


def test_a_path_of_a_ray_is_the_light_at_its_end(path):
    x = np.linspace(-1.0, 1.0, 3)
    np.testing.assert_array_equal(path(x), path.light(x))
    assert path(0.3, with_error=True).error >= 0.0
    with pytest.raises(ValueError, match=r"must be the 1 coordinates? x"):
        path(0.3, 0.2)


def test_spectra_of_every_step_are_those_of_its_light(path):
    """Closed form at each step against samples of the same step; the edge has a grid error."""
    W = (np.array([-0.3, 0.0, 0.2]), np.array([-0.2, 0.1]))
    mesh = np.meshgrid(*W, indexing="ij")
    grid = Grid.spanning((256, 96), (7.5, 5.0))
    bounds = (1e-12, 1e-12, 0.05, 0.01, 0.01)
    for step, spectrum, bound in zip(path.steps, path.spectra, bounds, strict=False):
        sampled = discrete_transform(eqx.filter_jit(grid.sample)(step), grid, *W)
        closed = eqx.filter_jit(spectrum)(*mesh)
        difference = np.max(np.abs(closed - sampled)) / np.max(np.abs(sampled))
        assert difference < bound
    line = Grid.spanning((96,), (8.0,))
    sampled = discrete_transform(eqx.filter_jit(line.sample)(path.light), line, W[0])
    closed = eqx.filter_jit(path.spectra[-1])(W[0])
    np.testing.assert_allclose(closed, sampled, rtol=0.0, atol=1e-10)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [(Travel, r"the class Travel: write Travel\(\.\.\.\)\."), (3.0, r"a float\.")],
)
def test_what_is_no_event_after_light_is_refused_in_a_sentence(wrong, words):
    with pytest.raises(TypeError, match=f"Argument `event` must be an event, but is {words}"):
        _ = light(FLATLAND) >> wrong


def test_a_refusal_travels_with_its_reason(path):
    covariances = path.covariances
    assert isinstance(covariances[1], Covariance)
    assert isinstance(covariances[2], Refused)
    assert "edge" in covariances[2].reason
    # From there on it is the same refusal, whatever follows.
    assert all(c is covariances[2] for c in covariances[3:])
    assert all(isinstance(F, Spectrum) for F in path.spectra)


def test_a_warp_stops_the_spectrum_and_not_the_light():
    path = light(FLATLAND) >> Travel(0.5) >> Incidence(0.4)
    spectra = path.spectra
    assert isinstance(spectra[1], Refused)
    assert "no simple Fourier formula" in spectra[1].reason
    assert spectra[2] is spectra[1]
    assert np.isfinite(path.light(*U))
    linear = light(FLATLAND) >> Travel(0.5).linearised(U) >> Incidence(0.4)
    assert isinstance(linear.spectra[2], Spectrum)


@pytest.mark.smoke
def test_the_event_of_the_path_is_named():
    blocker = Occlusion(half_plane(0.2, axis="theta"))
    path = light(FLATLAND_SLOPE) >> Travel(1.0) >> blocker >> Curvature(0.1)
    with pytest.raises(ValueError, match="transparency") as caught:
        _ = path.light
    assert caught.value.__notes__ == ["This is event 2 of the path, Occlusion."]
    with pytest.raises(ValueError, match="transparency") as caught:
        path.chain(light(FLATLAND_SLOPE))
    assert caught.value.__notes__ == ["This is event 2 of the path, Occlusion."]


def test_a_refused_spectrum_names_the_event_of_the_path():
    path = light(FLATLAND) >> Curvature(0.2) >> Occlusion(Function(lambda x, t: x * t))
    reason = path.spectra[2].reason
    assert reason.startswith("event 2 of the path, Occlusion convolves spectra")
    assert "give it one" in reason


def test_a_source_without_a_spectrum_says_so():
    field = half_plane_blocker(0.0, FLATLAND_SLOPE).transparency
    first, second = (field >> Travel(1.0)).spectra
    assert isinstance(first, Refused)
    assert second is first


def test_a_frame_that_an_event_cannot_act_on_is_named():
    require_frame(True, Mirror(), FLATLAND, "slopes")
    need = r"^Mirror needs slopes, but the light is incoming in \('x', 'theta'\)\.$"
    with pytest.raises(ValueError, match=need):
        require_frame(False, Mirror(), FLATLAND, "slopes")


@pytest.mark.smoke
def test_jets_want_one_ray():
    path = light(FLATLAND) >> Curvature(0.2)
    with pytest.raises(TypeError, match=r"`u` of Path.jets must be one ray|type hint"):
        path.jets(0.1, 0.2)


def test_jets_at_every_step(path):
    first = Path(path.source, Chain(path.events[:3]))
    for step, jet in zip(first.steps, first.jets(U), strict=True):
        np.testing.assert_array_equal(jet.hessian, step.jet(U).hessian)


def test_chains_and_events_associate():
    L = light(FLATLAND)
    a, b, c = Curvature(0.3), Mirror(), Curvature(0.3, back=True)
    ways = (L >> a >> b >> c, L >> (a >> b >> c), L >> (a >> b) >> c, L >> a >> (b >> c))
    values = [way.light(*U) for way in ways]
    assert all(v == values[0] for v in values)
    assert all(len(way.events) == 3 for way in ways)


def test_from_surface_to_surface():
    """Light leaves a surface obliquely, crosses space, arrives obliquely: every spectrum exists."""
    source = light(Frame(("x", "theta"), "outgoing"))
    path = (
        source
        >> Outgoing(0.3)
        >> Travel(2.0).linearised(jnp.zeros(2))
        >> Arrival()
        >> Incidence(-0.5)
    )
    assert [s.frame.sense for s in path.steps] == ["outgoing"] * 3 + ["incoming"] * 2
    W = (np.array([-0.1, 0.05]), np.array([0.0, 0.1]))
    grid = Grid.spanning((257, 128), (20.0, 5.0))
    sampled = discrete_transform(grid.sample(path.light), grid, *W)
    ours = path.spectra[-1](*np.meshgrid(*W, indexing="ij"))
    np.testing.assert_allclose(ours, sampled, rtol=0.0, atol=1e-10 * np.max(np.abs(sampled)))


def test_a_source_alone_is_a_path():
    path = Path(light(FLATLAND))
    assert path.light is path.source
    assert len(path.spectra) == 1


@pytest.mark.parametrize("other", [3, None, light()])
def test_a_chain_goes_on_with_events_alone(other):
    for begun in (Chain((Travel(1.0),)), Path(light(FLATLAND_SLOPE)), Travel(1.0)):
        with pytest.raises(TypeError):
            operator.rshift(begun, other)


WHOLE = [ToSlope(), Travel(0.7), Bump(wave(0.25, 0.2)), Cosine(), AngularFactor(Fresnel(1.5))]


@pytest.mark.parametrize("event", WHOLE)
@pytest.mark.parametrize("ask", [lambda f: f.jet, lambda f: jax.jit(f.jet)])
def test_whole_numbers_are_rays(event, ask):
    f = event(gaussian((0.3, 0.1), (1.0, 0.9)))
    ours, truth = ask(f)(jnp.array([1, 1])), f.jets(1.0, 1.0)
    for a, b in zip(jax.tree.leaves(ours), jax.tree.leaves(truth), strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-12)


def test_a_jet_is_pushed_at_whole_numbers():
    jet = gaussian((0.3, 0.1), (1.0, 0.9)).jet([0.9, 0.7])
    push = inspect.unwrap(ToSlope.push)  # as a user has it: annotations want floats
    ours, truth = (push(ToSlope(), jet, u).gradient for u in (jnp.array([1, 1]), jnp.ones(2)))
    np.testing.assert_array_equal(ours, truth)
