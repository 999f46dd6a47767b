"""Level sets: closed whatever they are of, and as large as they should be."""

import numpy as np
import pytest

from firstorder.models.blobs import isosurface, metaballs
from tests.models.test_primitives import check_closed, is_closed, mean_square_edge, volume

TWO = ([[0.0, 0, 0], [1.1, 0, 0]], [0.6, 0.6])


@pytest.mark.parametrize(
    ("piece", "characteristic"),
    [
        (lambda: metaballs(*TWO, 20), 2),
        (lambda: metaballs([[0.0, 0, 0], [3.0, 0, 0]], [0.6, 0.6], 30), 4),  # two
    ],
)
def test_they_are_closed_and_face_outwards(piece, characteristic):
    check_closed(piece(), characteristic)


def test_volume_of_a_ball():
    # A level set's corners are found linearly, and err by h^2 too: in all less than e^2 / R^2, and
    # a quarter in cells of half the size.
    true = 4.0 / 3.0 * np.pi * 0.125
    coarse, one = (metaballs([[1.0, 2.0, 3.0]], [0.5], n) for n in (20, 40))
    assert abs(volume(one) / true - 1.0) < mean_square_edge(one) / 0.5**2
    assert (volume(coarse) - true) / (volume(one) - true) == pytest.approx(4.0, rel=0.05)
    out = np.asarray(one.vertices) - [1.0, 2.0, 3.0]
    np.testing.assert_allclose(np.linalg.norm(out, axis=1), 0.5, rtol=0.0, atol=2e-3)


def test_any_set_of_lattice_points_has_a_closed_surface():
    """Noise makes every one of the 16 cases of a tetrahedron, next to every other."""
    values = np.full((7, 6, 8), -1.0)
    values[1:-1, 1:-1, 1:-1] = np.random.default_rng(0).normal(size=(5, 4, 6))
    found = isosurface(values, [0, 0, 0], 1.0)
    assert is_closed(found)
    # it faces outwards: along each axis, lines through the lattice enter before they leave
    np.testing.assert_allclose(np.sum(np.asarray(found.area_vectors), 0), 0.0, rtol=0.0, atol=1e-4)
    assert volume(found) > 0.0
    assert volume(isosurface(np.where(values > 0, 3.0, values), [0, 0, 0], 1.0)) > volume(found)


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: metaballs([[0, 0, 0]], [1.0, 2.0]), "`centers` and `radii` must have shapes"),
        (lambda: metaballs([[0, 0, 0]], [0.0]), "`radii` must be positive"),
        (lambda: metaballs([[0, 0, 0]], [1.0], cells=1), "`cells` must be more, but is 1"),
        (lambda: isosurface(np.ones((3, 3, 3)), [0, 0, 0], 1.0), "`values` must be positive"),
        (lambda: isosurface(-np.ones((3, 3, 3)), [0, 0, 0], 1.0), "`values` must be positive"),
    ],
)
def test_what_makes_no_piece_is_refused(call, sentence):
    with pytest.raises(ValueError, match=r"^Arguments? ") as caught:
        call()
    assert sentence in str(caught.value)


def test_differences_beyond_half_precision_are_no_less_exact():
    numbers = np.pad(np.full((2, 2, 2), 6e4), 1, constant_values=-6e4)
    made = isosurface(numbers.astype(np.float16), [0, 0, 0], 1.0)
    truth = isosurface(numbers / 6e4, [0, 0, 0], 1.0)
    np.testing.assert_allclose(made.vertices, truth.vertices, rtol=1e-12)


def test_lattices_that_are_none_are_named():
    values = np.pad(np.ones((2, 2, 2)), 1)
    with pytest.raises(ValueError, match=r"^Argument `step` must be positive, but is -1.0.$"):
        isosurface(values, [0, 0, 0], -1.0)
    for bad in (np.nan, np.inf):
        values[1, 1, 1] = bad
        with pytest.raises(ValueError, match=r"^Argument `values` must be finite"):
            isosurface(values, [0, 0, 0], 1.0)
