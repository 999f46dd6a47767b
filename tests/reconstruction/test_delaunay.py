"""Images from scattered samples: exact where they should be, whole where samples are missing."""

import numpy as np
import pytest

from firstorder.reconstruction.delaunay import delaunay_image

WIDTH, HEIGHT = 20, 14


@pytest.fixture(scope="module")
def places():
    rng = np.random.default_rng(3)
    corners = [(0.0, 0.0), (WIDTH, 0.0), (0.0, HEIGHT), (WIDTH, HEIGHT)]
    return np.concatenate([corners, rng.random((60, 2)) * (WIDTH, HEIGHT)])


def pixels():
    x, y = np.arange(WIDTH) + 0.5, np.arange(HEIGHT) + 0.5
    return np.stack(np.meshgrid(x, y, indexing="ij"), -1)


def quadratic(p):
    x, y = p[..., 0], p[..., 1]
    value = 0.3 * x**2 - 0.7 * x * y + 0.2 * y**2 + x - 2.0
    return value, np.stack([0.6 * x - 0.7 * y + 1.0, 0.4 * y - 0.7 * x], -1)


def test_linear_images_are_exact(places):
    value = places @ (3.0, -2.0) + 1.0
    found = delaunay_image(places, value, WIDTH, HEIGHT)
    np.testing.assert_allclose(found, pixels() @ (3.0, -2.0) + 1.0, rtol=0.0, atol=1e-12)


def test_samples_beyond_the_border_are_not_mirrored_into_the_image():
    x = np.arange(-1.0, 25.0, 4.0)
    p = np.stack(np.meshgrid(x, x, indexing="ij"), -1).reshape(-1, 2)
    value = np.where(p[:, 0] < 0.0, 5.0, p[:, 0])  # linear between samples, whatever is beyond
    x = pixels()[..., 0]
    expected = np.where(x < 3.0, 5.0 - 0.5 * (x + 1.0), x)
    found = delaunay_image(p, value, WIDTH, HEIGHT)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-12)


def test_gradients_make_quadratic_images_exact(places):
    value, gradient = quadratic(places)
    found = delaunay_image(places, value, WIDTH, HEIGHT, gradient=gradient, scheme="gradient")
    error = abs(found - quadratic(pixels())[0])
    assert np.max(error[6:-6, 4:-4]) < 1e-11
    # Samples mirrored in the border have no second derivatives: an error of second order there.
    assert 1e-3 < np.max(error) < 3.0


@pytest.mark.parametrize("fault", [lambda g: -g, lambda g: 2.0 * g, lambda g: g[:, ::-1]])
def test_wrong_gradients_are_seen(places, fault):
    value, gradient = quadratic(places)
    found = delaunay_image(
        places, value, WIDTH, HEIGHT, gradient=fault(gradient), scheme="gradient"
    )
    assert np.max(abs(found - quadratic(pixels())[0])[6:-6, 4:-4]) > 0.5


def test_third_order_of_smooth_images():
    """A wave twice as long, by the same samples, errs by an eighth."""
    x = np.arange(0.0, 33.0, 4.0)
    p = np.stack(np.meshgrid(x, x, indexing="ij"), -1).reshape(-1, 2)
    at, errors = np.arange(32) + 0.5, []
    for k in (np.array([0.21, 0.13]), np.array([0.105, 0.065])):
        value, gradient = np.sin(p @ k), np.cos(p @ k)[:, None] * k
        found = delaunay_image(p, value, 32, 32, gradient=gradient, scheme="gradient")
        truth = np.sin(k[0] * at[:, None] + k[1] * at)
        errors.append(np.sqrt(np.mean((found - truth)[8:-8, 8:-8] ** 2)))
    assert 2.8 < np.log2(errors[0] / errors[1]) < 3.2


def test_labels_are_not_mixed():
    """Two plane halves of different value meet at x = 8; samples lie on both sides of it."""
    x = np.arange(1.0, 16.0, 2.0)
    p = np.stack(np.meshgrid(x, x, indexing="ij"), -1).reshape(-1, 2)
    side = (p[:, 0] > 8.0).astype(int)
    value, gradient = np.where(side, 5.0 - p[:, 0], p[:, 0]), np.zeros_like(p)
    gradient[:, 0] = np.where(side, -1.0, 1.0)
    at = np.arange(16) + 0.5
    truth = np.where(at > 8.0, 5.0 - at, at)[:, None] + np.zeros(16)
    labels = np.broadcast_to((at > 8.0)[:, None], (16, 16)).astype(int)
    for scheme in ("linear", "gradient"):
        found = delaunay_image(p, value, 16, 16, gradient=gradient, scheme=scheme,
                            label=side, labels=labels)  # fmt: skip
        np.testing.assert_allclose(found, truth, rtol=0.0, atol=1e-12)
    mixed = delaunay_image(p, value, 16, 16)
    assert np.max(abs(mixed - truth)) > 2.0


def test_a_label_without_samples_takes_the_nearest(places):
    labels = np.zeros((WIDTH, HEIGHT), int)
    labels[3, 4] = 7
    value = np.ones(len(places))
    label = np.zeros(len(places), int)
    found = delaunay_image(places, value, WIDTH, HEIGHT, label=label, labels=labels)
    np.testing.assert_allclose(found, 1.0, rtol=1e-15)


def test_planes_continue_outside_of_the_hull():
    p = np.array([(4.0, 4.0), (8.0, 4.0), (4.0, 8.0), (8.0, 8.0)])
    at = np.stack(np.meshgrid(np.arange(12) + 0.5, np.arange(12) + 0.5, indexing="ij"), -1)
    found = delaunay_image(p, p @ (3.0, -1.0), 12, 12)
    np.testing.assert_allclose(found, at @ (3.0, -1.0), rtol=0.0, atol=1e-12)


def test_no_long_triangles_join_what_is_far_apart_along_the_border():
    """Samples in line half a pixel inside, a spike at the middle of the border."""
    x = np.arange(0.5, 32.0, 2.0)
    p = np.stack(np.meshgrid(x, x, indexing="ij"), -1).reshape(-1, 2)
    p[:, 0] += 0.2 * np.sin(p[:, 1])  # so that the hull is not the border
    value = np.exp(-np.sum((p - (0.0, 16.0)) ** 2, 1) / 8.0)
    found = delaunay_image(p, value, 32, 32)
    y = np.arange(32) + 0.5
    assert np.max(abs(found[0] - np.exp(-(0.25 + (y - 16.0) ** 2) / 8.0))) < 0.15


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (dict(scheme="cubic"), "`scheme` must be one of"),
        (dict(scheme="gradient"), "`gradient` is needed"),
        (dict(label=np.zeros(64, int)), "must come together"),
        (dict(gradient=np.zeros((3, 2))), "`gradient` must have shape"),
        (dict(value=np.zeros(3)), "`value` must have shape"),
        (dict(p=np.zeros((0, 2))), "`p` must have at least one sample"),
        (dict(width=0), "`width` must be a positive integer"),
    ],
)
def test_bad_input_gets_one_sentence(places, options, sentence):
    known = dict(p=places, value=np.ones(len(places)), width=WIDTH, height=HEIGHT)
    with pytest.raises(ValueError, match=sentence):
        delaunay_image(**(known | options))


def test_labels_of_another_image_are_refused():
    p = np.array([(1.0, 1.0), (3.0, 2.0)])
    with pytest.raises(ValueError, match=r"`labels` must have shape \(4, 2\), but has \(2, 4\)"):
        delaunay_image(p, p[:, 0], 4, 2, label=np.zeros(2, int), labels=np.zeros((2, 4), int))
