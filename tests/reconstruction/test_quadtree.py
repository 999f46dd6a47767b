"""Adaptive sampling of images: what is split, in which order, at what cost."""

import numpy as np
import pytest

from firstorder import reconstruction
from firstorder.reconstruction.delaunay import delaunay_image
from firstorder.reconstruction.importance import (
    QuadtreeCells,
    ShadedSamples,
    by_area,
    by_density,
    by_differences,
    by_gradient,
    by_hessian,
)
from firstorder.reconstruction.quadtree import ImageSamples, sample_image

WIDTH, HEIGHT = 96, 64


def rings(p, scale=12.0):
    """A picture with rings that grow finer, and its exact derivatives."""
    x = (p - (48.0, 32.0)) / scale
    r2 = np.sum(x * x, 1)
    s, c, fade = np.sin(r2), np.cos(r2), np.exp(-r2 / 8.0)
    first = fade * (c - s / 8.0)  # d/d(r2)
    second = fade * (-s - c / 4.0 + s / 64.0)
    outer = x[:, :, None] * x[:, None, :]
    H = 4.0 * second[:, None, None] * outer + 2.0 * first[:, None, None] * np.eye(2)
    return ShadedSamples(fade * s, 2.0 * first[:, None] * x / scale, H / scale**2)


def density(p):
    return ShadedSamples(p[:, 0], more=np.exp(-(((p[:, 0] - 48.0) / 8.0) ** 2)))


def pixels(width=WIDTH, height=HEIGHT):
    x, y = np.arange(width) + 0.5, np.arange(height) + 0.5
    return np.stack(np.meshgrid(x, y, indexing="ij"), -1).reshape(-1, 2)


@pytest.mark.parametrize("metric", [by_gradient, by_differences, by_hessian, by_area])
def test_squares_tile_the_image_and_hold_their_samples(metric):
    found = sample_image(rings, WIDTH, HEIGHT, 900, metric)
    assert isinstance(found, ImageSamples)
    leaf = found.size[found.leaf]
    assert np.sum(leaf**2) == WIDTH * HEIGHT
    assert 900 <= len(found.p) <= 903
    assert len(np.unique(found.p, axis=0)) == len(found.p)
    owner = np.floor(found.p[found.leaf] / leaf[:, None]) + 0.5
    np.testing.assert_array_equal(owner * leaf[:, None], found.p[found.leaf])
    np.testing.assert_array_equal(found.value, rings(found.p).value)


@pytest.mark.parametrize("metric", [by_gradient, by_hessian])
def test_one_square_at_a_time_splits_the_most_important(metric):
    """Against a list that is searched through again for every split."""
    found = sample_image(rings, WIDTH, HEIGHT, 300, metric, batch=0.0)
    shade = rings(found.p)
    own = metric(QuadtreeCells(found.size, shade, np.zeros_like(found.p)))
    alive = list(range(96))
    for first in range(96, len(found.p), 4):
        middle = found.p[first : first + 4].mean(0)
        split = min(alive, key=lambda i: np.sum((found.p[i] - middle) ** 2))
        np.testing.assert_allclose(found.p[split], middle, rtol=1e-15)
        assert own[split] >= (1.0 - 1e-12) * max(own[i] for i in alive)  # the rings have symmetry
        alive.remove(split)
        alive.extend(range(first, first + 4))


def test_batches_cost_little():
    """Asked: at most 2 % of RMSE against strict order, on an image."""

    def shade(p):
        return rings(p - (80.0, 96.0), 24.0)

    def error(batch):
        found = sample_image(shade, 256, 256, 8000, by_gradient, batch=batch)
        picture = delaunay_image(found.p, found.value, 256, 256)
        return np.sqrt(np.mean((picture.ravel() - shade(pixels(256, 256)).value) ** 2))

    assert error(0.03) <= 1.02 * error(0.0)


def test_batches_are_few():
    """Times are in `benchmarks/bench_images.py`; they rest on sorting squares seldom."""
    found = sample_image(rings, 512, 512, 44_564, by_gradient)
    assert found.rounds < 60


def test_differences_are_those_of_neighbours():
    """Exact for a plane, in the first grid and between quarters, at every size."""
    seen = []

    def metric(squares):
        seen.append(squares.differences)
        return by_area(squares)

    def plane(p):
        return ShadedSamples(3.0 * p[:, 0] - 2.0 * p[:, 1])

    sample_image(plane, WIDTH, HEIGHT, 1000, metric)
    np.testing.assert_allclose(np.concatenate(seen), [[3.0, -2.0]] * 1000, rtol=1e-12)


def test_differences_overlook_what_lies_between_the_samples():
    """R07 Fig. 16: a wave of the grid's own period looks flat without derivatives."""

    def wave(p):
        k = 2.0 * np.pi / 8.0
        slope = np.stack([k * np.cos(k * p[:, 0]), 0.0 * p[:, 0]], -1)
        return ShadedSamples(np.sin(k * p[:, 0]), slope)

    seen = []

    def metric(squares):
        seen.append((by_differences(squares), by_gradient(squares)))
        return by_area(squares)

    sample_image(wave, WIDTH, HEIGHT, 96, metric)
    assert np.max(seen[0][0]) < 1e-12 < 1.0 < np.min(seen[0][1])


def test_squares_with_two_objects_come_first_and_end_at_the_pixel():
    x, y = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT), indexing="ij")
    labels = ((x - 50) ** 2 + (y - 30) ** 2 < 20**2).astype(int)
    found = sample_image(rings, WIDTH, HEIGHT, 1500, by_area, labels=labels)
    for p, size in zip(found.p[found.leaf], found.size[found.leaf], strict=True):
        if size > 1.0:
            i, j = (p - 0.5 * size).astype(int)
            assert np.ptp(labels[i : i + int(size), j : j + int(size)]) == 0
    short = sample_image(rings, WIDTH, HEIGHT, 120, by_area, labels=labels)
    split = short.p[~short.leaf]
    assert np.all(abs(np.hypot(*(split - (50.0, 30.0)).T) - 20.0) < 8.0)


def test_a_density_draws_samples():
    found = sample_image(density, WIDTH, HEIGHT, 1000, by_density)
    assert np.mean(abs(found.p[:, 0] - 48.0) < 16.0) > 0.8


@pytest.mark.parametrize(("width", "height"), [(9, 7), (97, 50), (1, 1), (8, 500)])
def test_odd_sizes_stay_inside(width, height):
    found = sample_image(rings, width, height, 700, by_area)
    assert np.all((found.p > 0.0) & (found.p < (width, height)))
    parts = np.ceil(np.array([width, height]) / 8.0) * 8.0
    assert np.sum(found.size[found.leaf] ** 2) <= np.prod(parts)
    assert np.sum(found.size[found.leaf] ** 2) >= width * height
    if width * height > 1:
        picture = delaunay_image(found.p, found.p @ (2.0, 1.0), width, height)
        assert np.all(np.isfinite(picture))


def test_what_matters_nowhere_is_not_split():
    found = sample_image(lambda p: ShadedSamples(np.ones(len(p)), 0.0 * p), WIDTH, HEIGHT, 900)
    assert (len(found.p), found.rounds) == (96, 1)


def test_a_thorough_tree_leaves_nothing_out():
    """A disc that shows in no middle of the first grid, and no gradient at all."""

    def disc(p):
        inside = np.sum((p - 8.0) ** 2, 1) < 4.0
        return ShadedSamples(inside.astype(float), 0.0 * p)

    options = dict(smallest=1.0, labels=None)
    assert sample_image(disc, 32, 32, 1400, **options).value.max() == 0.0
    found = sample_image(disc, 32, 32, 1400, **options, thorough=True)
    assert len(found.p) == 16 + 64 + 256 + 1024
    assert found.value[found.leaf].sum() == disc(pixels(32, 32)).value.sum() > 0.0


def test_smallest_squares_stay_whole():
    found = sample_image(rings, 16, 16, 10_000, by_area, smallest=2.0)
    assert (found.size.min(), found.leaf.sum()) == (2.0, 64)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (dict(budget=95), "`budget` must be at least 96"),
        (dict(block=6), "`block` must be a power of 2, but is 6"),
        (dict(batch=1.5), "`batch` must be within"),
        (dict(width=0), "`width` must be positive"),
        (dict(labels=np.zeros((3, 3), int)), "`labels` must have shape"),
        (dict(metric=by_density), "needs a density"),
        (dict(metric=lambda s: s.size * np.nan), "must give numbers from 0 up"),
    ],
)
def test_bad_input_gets_one_sentence(change, sentence):
    arguments = dict(width=WIDTH, height=HEIGHT, budget=900, metric=by_gradient) | change
    with pytest.raises(ValueError, match=sentence):
        sample_image(rings, **arguments)


@pytest.mark.parametrize(
    ("shade", "words"),
    [
        (lambda p: p[:, 0], "`shade` must return ShadedSamples, but gives a ndarray"),
        (lambda p: ShadedSamples(p), "`shade` must return one value for each place"),
        (lambda p: ShadedSamples(p[:, 0], p[:, 0]), "`shade` must return one gradient for each"),
    ],
)
def test_what_shading_returns_fits_the_places(shade, words):
    with pytest.raises(ValueError, match=words):
        sample_image(shade, WIDTH, HEIGHT, 900)


@pytest.mark.parametrize(("metric", "what"), [(by_gradient, "gradients"), (by_hessian, "Hessians")])
def test_metrics_say_what_they_miss(metric, what):
    with pytest.raises(ValueError, match=f"needs {what}"):
        sample_image(lambda p: ShadedSamples(p[:, 0]), WIDTH, HEIGHT, 900, metric)


@pytest.mark.parametrize("name", ["differences", "bending"])
def test_differences_are_per_pixel_where_the_border_cuts_squares(name):
    """Of an image whose values and gradients are planes, every one is exact."""
    A, H, found = np.array([2.0, -1.0]), np.array([[3.0, 0.5], [0.5, -4.0]]), []

    def planes(p):
        return ShadedSamples(p @ A, p @ H)

    def metric(squares):
        found.append(getattr(squares, name))
        return by_area(squares)

    sample_image(planes, 11, 13, 60, metric, batch=0.5)
    for each in found:
        wanted = A if name == "differences" else H
        along = each if name == "differences" else np.diagonal(each, axis1=1, axis2=2)
        some = np.all(along != 0.0, 1)  # the others have a neighbour on one side, or none
        assert np.any(some)
        np.testing.assert_allclose(each[some], np.broadcast_to(wanted, each.shape)[some], 1e-12)


def test_a_metric_gives_one_number_for_each_square():
    def shade(p):
        return reconstruction.ShadedSamples(p[:, 0], more=[[[1.0, 0.0], [0.0, 2.0]]] * len(p))

    with pytest.raises(ValueError, match="must give one number for each square"):
        reconstruction.sample_image(shade, 16, 16, 20, lambda squares: squares.size[:, None])
    found = reconstruction.sample_image(shade, 16, 16, 20, reconstruction.by_hessian)
    assert len(found.p) == 20  # what a shading function returns may be lists
