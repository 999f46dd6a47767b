import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.caching import CLAMPS, ValidityRegion, circular_regions


@pytest.mark.smoke
@pytest.mark.parametrize("dims", [1, 2])
def test_clamps_are_reported(dims):
    found = circular_regions(jnp.array([0.0, 0.1, 0.5, 2.0, 3.0, jnp.inf]), 0.1, 2.0, dims)
    assert found.radius.tolist() == [0.1, 0.1, 0.5, 2.0, 2.0, 2.0]
    assert [CLAMPS[c] for c in found.clamp.tolist()] == ["raised", "", "", "", "cut", "cut"]
    assert np.isnan(circular_regions(jnp.nan, 0.1, 2.0, dims).radius)


def test_an_ellipse_has_the_radius_of_the_disc_of_its_area():
    region = ValidityRegion(jnp.array([[[2.0, 0.0], [0.0, 8.0]], [[0.0, 2.0], [8.0, 0.0]]]))
    np.testing.assert_allclose(region.radius, 0.25)
    lengths, angle = region.axes()
    np.testing.assert_allclose(lengths, [[0.5, 0.125]] * 2)
    np.testing.assert_allclose(angle % np.pi, [0.0, np.pi / 2], atol=1e-12)


def test_some_of_the_regions_are_chosen_with_what_acted():
    found = circular_regions(np.array([0.01, 0.2, 9.0]), 0.1, 1.0).at(np.array([2, 0]))
    assert found.radius.tolist() == [1.0, 0.1]
    assert found.clamp.tolist() == [1, -1]
    free = ValidityRegion(jnp.ones((3, 1, 1))).at(slice(2))
    assert free.clamp.tolist() == [0, 0]


@pytest.mark.smoke
@pytest.mark.parametrize("dims", [1, 2])
@pytest.mark.parametrize(
    ("given", "words"),
    [
        ((1.0, 2.0, 1.0), "Argument `high` must be at least 2, but is 1."),
        ((1.0, 0.0, 1.0), "Argument `low` must be positive, but is 0.0."),
        ((jnp.ones(2), -1.0, 1.0), "Argument `low` must be positive, but is -1.0."),
        ((-1.0, 0.1, 1.0), "Argument `radius` must not be negative, but is -1.0."),
    ],
)
def test_bad_input_is_one_sentence(given, words, dims):
    with pytest.raises(ValueError, match=r"must") as failure:
        circular_regions(*given, dims)
    assert str(failure.value) == words


def test_another_number_of_dimensions_is_refused():
    with pytest.raises(ValueError, match=r"^Argument `dims` must be 1 or 2, but is 3.$"):
        circular_regions(1.0, 0.1, 1.0, 3)
