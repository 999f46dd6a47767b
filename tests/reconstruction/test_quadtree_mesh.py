"""Images over a quad-tree's own triangles: exact where they must be, and as good as Delaunay's."""

import numpy as np
import pytest

from firstorder.reconstruction import (
    ShadedSamples,
    by_gradient,
    delaunay_image,
    quadtree_image,
    quadtree_mesh,
    sample_image,
)
from firstorder.reconstruction._triangles import Vertices


def centres(width, height):
    x, y = np.arange(width) + 0.5, np.arange(height) + 0.5
    return np.stack(np.meshgrid(x, y, indexing="ij"), -1)


def plane(p):
    return ShadedSamples(2.0 * p[:, 0] - p[:, 1], np.tile([[2.0, -1.0]], (len(p), 1)))


def waves(p):
    x, y = (p - 32.0).T / 10.0
    bell = np.exp(-x * x - y * y)
    slope = [-2.0 * x * np.sin(4.0 * x) + 4.0 * np.cos(4.0 * x), -2.0 * y * np.sin(4.0 * x)]
    return ShadedSamples(bell * np.sin(4.0 * x), np.stack(slope, -1) * bell[:, None] / 10.0)


def of(shade, width, height, share=0.25, **options):
    return sample_image(shade, width, height, int(share * width * height) + 8, **options)


@pytest.mark.smoke
@pytest.mark.parametrize("size", [(64, 64), (30, 45), (8, 8), (5, 40)])
@pytest.mark.parametrize("smallest", [0.5, 1.0])
@pytest.mark.parametrize("sloped", [False, True])
def test_a_plane_is_a_plane_up_to_the_border(size, smallest, sloped):
    found = of(plane, *size, share=0.4, smallest=smallest)
    found = found if sloped else found._replace(gradient=None)
    true = plane(centres(*size).reshape(-1, 2)).value.reshape(size)
    np.testing.assert_allclose(quadtree_image(found, *size), true, rtol=0.0, atol=1e-10)


@pytest.mark.parametrize("scheme", ["linear", "gradient"])
def test_it_errs_as_delaunays_triangles_do(scheme):
    found, true = of(waves, 64, 64), waves(centres(64, 64).reshape(-1, 2)).value.reshape(64, 64)
    given = (found.p, found.value, 64, 64)
    ours, theirs = (
        np.sqrt(np.mean((image - true) ** 2))
        for image in (
            quadtree_image(found, 64, 64, scheme=scheme),
            delaunay_image(*given, gradient=found.gradient, scheme=scheme),
        )
    )
    assert ours < 1.05 * theirs


def meshed(monkeypatch, width, height, **options):
    """The triangles of a tree, all of them, and its samples with those beyond the border."""
    seen, kept = {}, quadtree_mesh._triangles

    def every(at, cells, split, wide):
        triangle = kept(at, cells, split, np.ones_like(wide))
        seen.update(at=at, triangle=triangle)
        return triangle

    monkeypatch.setattr(quadtree_mesh, "_triangles", every)
    quadtree_image(of(waves, width, height, **options), width, height)
    monkeypatch.undo()
    return seen["at"], seen["triangle"]


def area(p, triangle):
    u, v = p[triangle[:, 1]] - p[triangle[:, 0]], p[triangle[:, 2]] - p[triangle[:, 0]]
    return 0.5 * (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])


def uncovered(at: Vertices, triangle, width, height) -> float:
    """Share of random places of the image that do not lie in one triangle, and in one alone."""
    places = np.random.default_rng(1).uniform(0.0, 1.0, (2000, 2)) * (width, height)
    a, b, c = at.p[triangle].transpose(1, 0, 2)
    whole = area(at.p, triangle)

    def weight(p, q):
        d, e = q - p, places[:, None] - p
        return 0.5 * (d[:, 0] * e[..., 1] - d[:, 1] * e[..., 0]) / whole

    inside = (weight(a, b) > 0.0) & (weight(b, c) > 0.0) & (weight(c, a) > 0.0)
    return float(np.mean(inside.sum(1) != 1))


@pytest.mark.parametrize("options", [{}, {"block": 16}, {"share": 0.05}])
def test_triangles_cover_the_image_once(monkeypatch, options):
    at, triangle = meshed(monkeypatch, 64, 64, **options)
    signs = np.sign(area(at.p, triangle))
    assert np.all(signs == signs[0])
    assert np.all(np.isin(np.arange(len(of(waves, 64, 64, **options).p)), triangle))  # all are used
    assert uncovered(at, triangle, 64, 64) == 0.0


@pytest.mark.parametrize("fault", ["no fan", "one half"])
def test_holes_are_noticed(monkeypatch, fault):
    at, triangle = meshed(monkeypatch, 64, 64)
    wrong = triangle[::2] if fault == "one half" else triangle[: -len(triangle) // 5]
    assert uncovered(at, wrong, 64, 64) > 0.01


def test_labels_keep_what_another_object_shows_out():
    """Two planes side by side: each pixel has its own."""
    labels = (np.arange(32)[:, None] >= 13).astype(int) + np.zeros((32, 32), int)

    def shade(p):
        right = p[:, 0] >= 13.0
        return ShadedSamples(np.where(right, 9.0, p[:, 0]), np.stack([1.0 - right, 0.0 * right], 1))

    found = of(shade, 32, 32, labels=labels, metric=by_gradient)
    label = (found.p[:, 0] >= 13.0).astype(int)
    image = quadtree_image(found, 32, 32, label=label, labels=labels)
    true = shade(centres(32, 32).reshape(-1, 2)).value.reshape(32, 32)
    np.testing.assert_allclose(image, true, rtol=0.0, atol=1e-12)


def test_bad_input():
    found = of(plane, 16, 16)
    with pytest.raises(ValueError, match="`scheme` must be one of"):
        quadtree_image(found, 16, 16, scheme="cubic")
    with pytest.raises(ValueError, match="`gradient` is needed"):
        quadtree_image(found._replace(gradient=None), 16, 16, scheme="gradient")
    with pytest.raises(ValueError, match="must come together"):
        quadtree_image(found, 16, 16, label=np.zeros(len(found.p), int))


@pytest.mark.parametrize("size", [(12, 20), (32, 20), (20, 13)])
def test_an_image_of_another_size_is_refused(size):
    """A larger one was once filled with numbers of one sample."""
    found = of(plane, 20, 12)
    with pytest.raises(ValueError, match="must be those of the samples, 20 and 12, but are"):
        quadtree_image(found, *size)
