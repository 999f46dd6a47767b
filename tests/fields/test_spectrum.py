import operator

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firstorder.checks.tolerance import normwise
from firstorder.conventions import FLATLAND, FLATLAND_SLOPE
from firstorder.fields import Grid, SampledSpectrum, discrete_transform, gaussian
from firstorder.numerics._compiled import compiled

SIZES = st.tuples(st.integers(3, 9), st.integers(3, 9))


@settings(max_examples=6)
@given(SIZES, st.integers(0, 9))
def test_parseval(size, seed):
    grid = Grid(size, (0.3, 0.2), (0.1, 0.4))
    samples = np.random.default_rng(seed).normal(size=size)
    F = discrete_transform(samples, grid, grid.frequencies(0), grid.frequencies(1))
    by_frequency = np.sum(np.abs(F) ** 2) / (grid.extent[0] * grid.extent[1])
    assert by_frequency == pytest.approx(np.sum(samples**2) * grid.cell)


@settings(max_examples=6)
@given(SIZES, st.floats(-2.0, 2.0))
def test_a_shift_is_a_phase(size, shift):
    samples = np.random.default_rng(0).normal(size=size)
    Omega = np.array([0.3, -1.1]), np.array([0.7])
    here = discrete_transform(samples, Grid(size, (0.3, 0.2)), *Omega)
    there = discrete_transform(samples, Grid(size, (0.3, 0.2), (shift, 0.0)), *Omega)
    phase = np.exp(-2j * np.pi * Omega[0] * shift)[:, None]
    np.testing.assert_allclose(there, here * phase, rtol=0.0, atol=1e-13)


def test_one_frequency_at_a_time_is_the_same():
    f = gaussian((0.2, -0.1), (0.5, 0.4), 0.3)
    grid = Grid.spanning((48, 49), (4.0, 3.5))
    F = SampledSpectrum.of(f, grid)
    Omega = np.array([-0.4, 0.1]), np.array([0.0, 0.3, 0.8])
    table = discrete_transform(F.samples, grid, *Omega)
    assert normwise(F(*np.meshgrid(*Omega, indexing="ij")), table) < 1e-14


def test_samples_that_are_too_few_tell_their_error():
    """Of a bell that is wider than the box, and of one that is narrower than a step."""
    grid = Grid((24, 24), (0.25, 0.25))
    for sigma in ((1.5, 0.5), (0.5, 0.1)):
        f = gaussian((0.2, -0.1), sigma)
        value, error = SampledSpectrum.of(f, grid)(0.1, 0.2, with_error=True)
        true = f.spectrum()(0.1, 0.2)
        assert 1e-6 < abs(value - true) < error
        assert error < abs(true)


def test_spectra_add():
    f, g = gaussian((0.2, -0.1), (0.5, 0.4)), gaussian((0.0, 0.3), (0.3, 0.4), 0.2)
    both = f.spectrum() + g.spectrum()
    assert complex(both(0.2, 0.1)) == pytest.approx(
        complex(f.spectrum()(0.2, 0.1)) + complex(g.spectrum()(0.2, 0.1))
    )


def test_a_moved_grid_holds_the_image_of_its_box():
    M, c = jnp.array([[1.0, -0.8], [0.3, 1.0]]), jnp.array([0.2, -0.1])
    grid = Grid((7, 8), (0.3, 0.2), (0.5, 0.0))
    box = grid.moved(M, c)
    corners = np.array([[i, j] for i in (-1, 1) for j in (-1, 1)]) * np.array(grid.extent) / 2
    image = (corners + np.array(grid.center)) @ np.asarray(M).T + np.asarray(c)
    for i in range(2):
        ends = np.array(box.center[i]) + np.array([-0.5, 0.5]) * np.array(box.extent[i])
        np.testing.assert_allclose(
            ends, [image[:, i].min(), image[:, i].max()], rtol=0.0, atol=1e-14
        )
    assert box.size == grid.size


def test_a_moved_grid_may_be_traced():
    def width(d):
        return Grid((7, 8), (0.3, 0.2)).moved(jnp.array([[1.0, 0.0], [0.0, 1.0]]) * d, jnp.zeros(2)).extent[0]  # fmt: skip  # noqa: E501

    assert jax.grad(width)(1.0) == pytest.approx(2.1)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Grid((), ()), "`size` must hold at least one sample"),
        (lambda: Grid((0, 3), (1.0, 1.0)), "`size` must hold at least one sample"),
        (lambda: Grid((3, 3), (1.0,)), "`step` must have 2 entries, but has 1"),
        (lambda: Grid((3, 3), (1.0, -1.0)), "`step` must be positive, but is -1.0"),
        (lambda: Grid((3, 3), (1.0, float("nan"))), "`step` must be positive, but is nan"),
        (lambda: Grid((3,), (1.0,), (0.0, 0.0)), "`center` must have 1 entries, but has 2"),
        (lambda: Grid((3,), (1.0,), (np.nan,)), "`center` must be finite, but is nan"),
        (lambda: Grid((3,), (1.0,), (1j,)), "`center` must be real, but is complex"),
        (lambda: discrete_transform(np.zeros((3, 4)), Grid((4, 3), (1.0, 1.0))),
         r"`samples` must have shape \(4, 3\), but has \(3, 4\)"),
    ],
)  # fmt: skip
def test_bad_input(make, words):
    with pytest.raises(ValueError, match=words):
        make()


@pytest.mark.smoke
def test_a_grid_is_numbers_that_stay():
    """A program is kept with them: of a list changed afterwards it took others for the old ones."""
    step = [0.5]

    @compiled
    def spacing(grid, x):
        return x * grid.step[0]

    def of(step):
        return spacing(Grid((4,), step), jnp.ones(())).item()  # pyright: ignore

    try:
        grid = Grid((4,), step)  # pyright: ignore[reportArgumentType]
        assert (of(step), of(step)) == (0.5, 0.5)
        step[0] = 5.0
        assert (grid.step, of(step), of([5.0])) == ((0.5,), 5.0, 5.0)
    except TypeError as error:  # the import hook says that a list is no tuple
        assert "type hint" in str(error)  # noqa: PT017


@pytest.mark.smoke
@pytest.mark.parametrize(
    ("size", "step", "words"),
    [
        (4, (1.0,), "`size` must hold a number for each coordinate, but is an int"),
        ((4,), 1.0, "`step` must hold a number for each coordinate, but is a float"),
        ((4,), ("a",), "`step` must hold numbers, but holds a str"),
    ],
)
def test_a_grid_has_a_number_for_each_coordinate(size, step, words):
    with pytest.raises(TypeError, match=f"^Argument {words}|type hint"):
        Grid(size, step)


@pytest.mark.smoke
def test_the_step_of_a_grid_is_not_traced():
    """The program of such a grid was kept with what had become of its step."""
    with pytest.raises(
        (TypeError, ValueError), match=r"`step` must hold numbers, but is traced|type"
    ):
        jax.grad(lambda h: Grid((4,), (h,)).extent[0])(0.25)


def test_spectra_over_other_frequencies_do_not_add():
    F, G = (
        gaussian((0.0, 0.0), (1.0, 1.0), frame=f).spectrum() for f in (FLATLAND, FLATLAND_SLOPE)
    )
    with pytest.raises(ValueError, match="`spectra` must share one frame"):
        operator.add(F, G)
    with pytest.raises(TypeError):
        operator.add(F, 1.0)
    np.testing.assert_array_equal((F + F)(0.1, 0.2), 2.0 * F(0.1, 0.2))


def test_samples_are_transformed_along_all_axes_and_grids_have_whole_sizes():
    grid = Grid((4, 4), (1.0, 1.0))
    with pytest.raises(ValueError, match="`frequencies` must be 2 arrays"):
        discrete_transform(np.ones((4, 4)), grid, np.zeros(1))
    with pytest.raises((TypeError, ValueError)):
        Grid((4.5, 4), (1.0, 1.0))
