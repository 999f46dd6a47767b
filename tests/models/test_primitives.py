"""Pieces of scenes: closed where they say so, facing outwards, the same from the same seed."""

import time

import numpy as np
import pytest

from firstorder.models.primitives import (
    bar_lattice,
    bumpy_sphere,
    displaced_ground,
    join_meshes,
    place_mesh,
    quad_triangles,
    ripples,
    rotation_about,
)
from firstorder.space.meshes.triangle_mesh import mesh


def euler(piece):
    """Vertices less edges plus faces, counted from the faces alone."""
    f = np.asarray(piece.faces)
    ends = {tuple(sorted((int(t[k]), int(t[(k + 1) % 3])))) for t in f for k in range(3)}
    return len(np.unique(f)) - len(ends) + len(f)


def is_closed(piece):
    """Whether every edge is run exactly once each way, counted from the faces alone."""
    runs = [(int(t[k]), int(t[(k + 1) % 3])) for t in np.asarray(piece.faces) for k in range(3)]
    return len(set(runs)) == len(runs) and {(b, a) for a, b in runs} == set(runs)


def volume(piece):
    return np.sum(np.linalg.det(np.asarray(piece.corners, float))) / 6.0


def check_closed(piece, characteristic):
    assert is_closed(piece)
    assert piece.closed
    assert euler(piece) == characteristic
    assert volume(piece) > 0.0


def mean_square_edge(piece):
    c = np.asarray(piece.corners, float)
    return np.mean(np.sum((c - np.roll(c, 1, 1)) ** 2, -1))


@pytest.mark.parametrize(
    ("piece", "characteristic"),
    [
        (lambda: bumpy_sphere(levels=3), 2),
        (lambda: bar_lattice((3, 2)), 2 - 2 * 6),
        (lambda: bar_lattice((0, 0)), 2),
        (lambda: bar_lattice((2, 0), (1.0, 0.3), 0.1), 6),  # three slats that do not meet
    ],
)
def test_closed_pieces_are_closed_and_face_outwards(piece, characteristic):
    check_closed(piece(), characteristic)


def test_a_missing_face_is_noticed():
    piece = bar_lattice((1, 1))
    open_ = mesh(piece.vertices, np.asarray(piece.faces)[1:])
    turned_about = np.asarray(piece.faces).copy()
    turned_about[0] = turned_about[0][::-1]
    assert not is_closed(open_)
    assert not is_closed(mesh(piece.vertices, turned_about))
    assert euler(open_) != euler(piece)


def test_volumes_are_those_of_the_shapes():
    # Faces lie below a sphere through their corners by e^2 / (8 R) on average, e^2 the mean square
    # of the edges; what that leaves out is of the next order, e^2 / R^2 = 0.6 % of it.
    flat = bumpy_sphere(2.0, lambda n: np.zeros(len(n)), levels=4)
    missing = 3.0 * mean_square_edge(flat) / (8.0 * 2.0**2)
    assert 1.0 - volume(flat) / (32.0 / 3.0 * np.pi) == pytest.approx(missing, rel=0.01)
    # 3 x 2 holes of ((4 - 4 * 0.1)/3) x ((2 - 3 * 0.1)/2)
    full = 4.0 * 2.0 - 6 * (3.6 / 3) * (1.7 / 2)
    assert volume(bar_lattice((3, 2), (2.0, 1.0), 0.1, 0.05)) == pytest.approx(
        0.05 * full, rel=1e-5
    )


def test_ground_follows_its_height_and_looks_up():
    height = ripples(0.1, 0.5, seed=3)
    field = displaced_ground(1.5, height, 20, (0.5, -0.25))
    v = np.asarray(field.vertices, float)
    np.testing.assert_allclose(v[:, 2], height(v[:, :2]), rtol=0.0, atol=1e-5)
    assert np.all(np.asarray(field.area_vectors)[:, 2] > 0.0)
    np.testing.assert_allclose(v[:, :2].min(0), [-1.0, -1.75], rtol=0.0, atol=1e-6)
    assert not field.closed


@pytest.mark.parametrize("dimension", [2, 3])
def test_ripples_have_the_size_that_was_asked_for(dimension):
    places = np.random.default_rng(1).uniform(0, 400.0, (40000, dimension))
    for wavelength in (0.5, 2.0):
        h = ripples(0.2, wavelength, 5)
        # four standard deviations of a standard deviation of so many places
        assert h(places).std() == pytest.approx(0.2, rel=4.0 / np.sqrt(2.0 * len(places)))
        # RMS slope of waves of random length: 2 pi a mean(1/l^2)^0.5, here over 2/3..4/3
        moved = places.copy()
        moved[:, 0] += 1e-3 * wavelength
        slope = (h(moved) - h(places)) / (1e-3 * wavelength)
        expected = 2.0 * np.pi * 0.2 / wavelength * np.sqrt(1.125 / dimension)
        assert slope.std() == pytest.approx(expected, rel=0.35)  # 24 waves only


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_wave_of_ripples_is_from_two_to_four_thirds_as_long_as_asked_for(dimension):
    """A wave alone bends by `-(2 pi / length)^2` of its height, over all directions."""
    places = np.random.default_rng(0).uniform(0.0, 5.0, (1, dimension))
    steps, lengths = 1e-3 * np.eye(dimension), []
    for seed in range(300):
        h = ripples(0.2, 0.5, seed, 1)
        around = h(places + steps) + h(places - steps) - 2.0 * h(places)
        lengths.append(2.0 * np.pi / np.sqrt(-np.sum(around) / 1e-6 / h(places)[0]))
    assert 0.333 < min(lengths) < 0.34
    assert 0.66 < max(lengths) < 0.667
    assert np.mean(lengths) == pytest.approx(0.5, abs=0.02)


@pytest.mark.parametrize(
    "make",
    [
        lambda seed: bumpy_sphere(levels=2, seed=seed),
        lambda seed: displaced_ground(1.0, ripples(0.1, 0.3, seed), 10),
    ],
)
def test_the_same_seed_gives_the_same_bits(make):
    a, b, other = make(3), make(3), make(4)
    assert np.asarray(a.vertices).tobytes() == np.asarray(b.vertices).tobytes()
    assert np.asarray(a.vertices).tobytes() != np.asarray(other.vertices).tobytes()


def test_joined_keeps_every_part_and_its_edges():
    parts = [bar_lattice((1, 1)), displaced_ground(1.0, cells=2), bumpy_sphere(levels=0)]
    both, part = join_meshes(parts)
    again = mesh(both.vertices, both.faces)  # its edges found anew
    ways = [set(map(tuple, np.asarray(m.edges))) for m in (both, again)]
    assert {tuple(sorted(e)) for e in ways[0]} == {tuple(sorted(e)) for e in ways[1]}
    for (a, b), (left, right) in zip(both.edges, both.sides, strict=True):
        for face, run in ((left, (a, b)), (right, (b, a))):
            f = both.faces[face]
            assert face == -1 or run in [(f[k], f[(k + 1) % 3]) for k in range(3)]
    assert np.bincount(part).tolist() == [p.count for p in parts]
    for k, p in enumerate(parts):
        np.testing.assert_array_equal(np.asarray(both.corners)[part == k], np.asarray(p.corners))


def test_placed_scales_then_turns_then_shifts():
    piece = bumpy_sphere(levels=1)
    R = rotation_about((1.0, 2.0, -1.0), 0.7)
    found = place_mesh(piece, (1.0, 2.0, 3.0), R, 2.0)
    expected = [R @ (2.0 * p) + [1.0, 2.0, 3.0] for p in np.asarray(piece.vertices, float)]
    np.testing.assert_allclose(np.asarray(found.vertices), expected, rtol=1e-5)
    assert volume(found) == pytest.approx(8.0 * volume(piece), rel=1e-4)
    np.testing.assert_allclose(R @ [1.0, 2.0, -1.0], [1.0, 2.0, -1.0], rtol=0.0, atol=1e-12)
    assert np.trace(R) == pytest.approx(1.0 + 2.0 * np.cos(0.7))
    np.testing.assert_allclose(
        rotation_about((0, 0, 1), 0.3) @ [1, 0, 0], [np.cos(0.3), np.sin(0.3), 0]
    )


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: join_meshes([]), "`parts` must hold a mesh"),
        (lambda: place_mesh(bar_lattice(), scale=0.0), "`scale` must be positive"),
        (lambda: place_mesh(bar_lattice(), shift=1.0), "`shift` must have shape (3,)"),
        (
            lambda: place_mesh(bar_lattice(), turn=np.diag([1.0, 1.0, -1.0])),
            "`turn` must be a rotation",
        ),
        (lambda: rotation_about((0, 0, 0), 1.0), "`axis` must be positive"),
        (lambda: bumpy_sphere(0.0), "`radius` must be positive"),
        (lambda: bumpy_sphere(1.0, lambda n: np.full(len(n), -1.0)), "`height` must be above -1"),
        (lambda: bumpy_sphere(1.0, lambda n: np.full(len(n), np.nan)), "`height` must be above -1"),
        (lambda: displaced_ground(cells=0), "`cells` must be a positive integer"),
        (
            lambda: displaced_ground(height=lambda p: np.full(len(p), np.inf)),
            "`height` must be finite",
        ),
        (lambda: bar_lattice((8, 8), width=0.3), "`width` must leave room for 8 holes"),
        (lambda: bar_lattice(thickness=0.0), "`thickness` must be positive"),
        (lambda: ripples(-1.0, 1.0), "`amplitude`"),
    ],
)
def test_what_makes_no_piece_is_refused(call, sentence):
    with pytest.raises(ValueError, match=r"^Arguments? ") as caught:
        call()
    assert sentence in str(caught.value)


def test_edges_of_a_million_faces_are_found_quickly():
    start = time.process_time()
    assert displaced_ground(cells=700, height=ripples(0.1, 0.3, waves=4)).count == 980000
    assert time.process_time() - start < 6.0  # 0.9 s where it was measured; a sort of rows took 4


def test_a_quadrangle_is_cut_in_two_that_turn_as_it_does():
    faces = quad_triangles([0, 4], [1, 5], [2, 6], [3, 7])
    assert faces.tolist() == [[0, 1, 2], [4, 5, 6], [0, 2, 3], [4, 6, 7]]
    square = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0)])
    halves = mesh(square, quad_triangles(0, 1, 2, 3)).area_vectors
    np.testing.assert_array_equal(halves, [[0.0, 0.0, 1.0]] * 2)


@pytest.mark.parametrize("made", [bumpy_sphere, displaced_ground])
def test_a_height_that_is_one_number_for_all_places_is_refused(made):
    with pytest.raises(ValueError, match=r"^Argument `height` must give one number for each of"):
        made(height=lambda places: 0.1)


def test_the_middle_of_a_ground_has_two_coordinates():
    with pytest.raises(ValueError, match="`center` must have shape"):
        displaced_ground(center=3.0)
