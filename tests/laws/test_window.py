"""Windows: one that holds the light, and a warning for one that does not."""

import warnings

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.cases import light
from firstorder.conventions import FLATLAND, FLATLAND_SLOPE
from firstorder.fields import Affine, Grid, SoftEdge, gaussian, half_plane
from firstorder.laws import Multiply
from firstorder.laws._window import holding, warn_if_cut
from firstorder.transport import Cosine, Texture, Travel, half_plane_blocker, wave

SMALL = Grid.spanning((64, 1), (1.0, 1.0))


@pytest.mark.smoke
def test_a_window_that_cuts_the_light_warns_in_one_sentence():
    blocker = half_plane_blocker(0.1, FLATLAND_SLOPE, window=SMALL)
    says = r"^Argument `window` of Occlusion does not hold the light: along the edge's level"
    with pytest.warns(UserWarning, match=says) as caught:
        blocker(light(FLATLAND_SLOPE).spectrum())
    assert len(caught) == 1
    assert caught[0].filename == __file__  # where the user stands


@pytest.mark.parametrize("x", [0.0, 6.0])
def test_the_warning_is_right(x):
    """Where it warns the spectrum is wrong, and where it does not it is not."""
    F, edge = gaussian((x, 0.0), (0.5, 0.4)).spectrum(), half_plane(x + 0.1)
    exact = Multiply(edge)(F)(0.3, 0.2)
    for half, wrong in ((0.8, True), (4.5, False)):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            ours = Multiply(edge, Grid.spanning((256, 1), (half, 1.0), (x, 0.0)))(F)(0.3, 0.2)
        assert bool(caught) is wrong
        assert bool(abs(ours - exact) > 1e-3) is wrong


def test_light_that_has_travelled_out_of_the_window_is_seen():
    L, window = light(FLATLAND_SLOPE), Grid.spanning((64, 1), (3.5, 1.0))
    blocker = half_plane_blocker(0.1, FLATLAND_SLOPE, window=window)
    blocker(L.spectrum())
    with pytest.warns(UserWarning, match="does not hold the light"):
        (Travel(5.0) >> blocker)(L.spectrum())


def test_only_what_the_factor_depends_on_must_be_held():
    F = light().spectrum()
    Cosine(window=Grid.spanning((1, 96), (0.1, 6.0)))(F)
    Texture(wave(0.3), window=Grid.spanning((8, 8), (0.1, 0.1)))(F)  # three waves on any window
    with pytest.warns(UserWarning, match="along theta it is from -1.6 to 1.6"):
        Cosine(window=Grid.spanning((1, 96), (6.0, 1.6)))(F)


def test_a_factor_that_widens_its_own_period_is_not_warned_about():
    soft = SoftEdge(Affine([1.0, 0.0], 0.0), 0.5)
    Multiply(soft, Grid.spanning((64, 1), (0.5, 0.5)))(light().spectrum())


def test_nothing_is_said_about_traced_light():
    def spectrum(x):
        L = gaussian(jnp.stack([x, 0.0]), (0.5, 0.4))
        return Multiply(half_plane(0.1), SMALL)(L.spectrum())(0.3, 0.2)

    jax.jit(spectrum)(0.2)
    warn_if_cut(half_plane(0.1), Grid.spanning((8, 1), (9.0, 1.0)), light().spectrum(), "multiply")


def test_the_window_of_a_traced_light_moves_with_it():
    def spectrum(x):
        return Cosine()(gaussian(jnp.stack([x, 0.3]), (0.5, 0.4)).spectrum())(0.3, 0.2)

    assert abs(jax.jit(spectrum)(3.0) - spectrum(jnp.asarray(3.0))) < 1e-13
    window = jax.jit(
        lambda x: holding(gaussian(jnp.stack([x, 0.3]), (0.5, 0.4)).spectrum().extent())
    )(2.0)
    np.testing.assert_allclose(window.center, [2.0, 0.3], rtol=1e-14)
    assert FLATLAND.dims == len(window.size)
