"""An image from few shaded pixels: gradients pay, and nothing crosses an edge."""

import numpy as np
import pytest

from firstorder.imaging.camera import pinhole
from firstorder.imaging.images import render
from firstorder.reconstruction.image import interpolate_image
from firstorder.space import Scene, plane, primitive, sphere

CAMERA = pinhole((0.4, -4.0, 1.8), (0.2, 0.1, 0.7), gamma=1.6)


@pytest.fixture(scope="module")
def world():
    floor = primitive(plane((0, 0, 0), (0, 0, 1)), albedo=0.7)
    return Scene.of(floor, primitive(sphere((0.0, 0.0, 0.9), 0.7), albedo=0.5), environment=1.0)


@pytest.fixture(scope="module")
def images(world):
    size = {"columns": 65, "rows": 49}
    each = {s: interpolate_image(world, CAMERA, **size, step=4, scheme=s)
            for s in ("hermite", "bilinear")}  # fmt: skip
    return render(world, CAMERA, **size), each


def rms(a):
    return float(np.sqrt(np.mean(np.square(a))))


def whole(label):
    """Pixels of cells whose four nodes show one face: no edge has cut them."""
    nodes = label[::4, ::4]
    cells = [
        nodes[i : len(nodes) - 1 + i, j : nodes.shape[1] - 1 + j] for i in (0, 1) for j in (0, 1)
    ]
    same = np.all([c == cells[0] for c in cells], 0)
    inside = np.zeros(label.shape, bool)
    inside[:-1, :-1] = np.kron(same, np.ones((4, 4), bool))
    return inside & (np.pad(np.kron(cells[0], np.ones((4, 4), int)), ((0, 1), (0, 1))) == label)


def test_gradients_buy_a_better_image_from_the_same_pixels(images):
    """Away from edges; in cells that an edge cuts neither scheme has a neighbour on each side."""
    truth, each = images
    inside = whole(truth.label)
    for shape in (0, 6):  # the ball and the floor
        here = inside & (truth.label == shape)
        assert here.sum() > 100
        errors = {k: rms((image.value - truth.value)[here]) for k, image in each.items()}
        assert errors["hermite"] < 0.3 * errors["bilinear"]
    assert rms(each["hermite"].value - truth.value) < rms(each["bilinear"].value - truth.value)
    assert np.mean(each["hermite"].shaded) < 0.1


def test_nodes_and_what_nothing_is_known_of_are_shaded(images):
    truth, each = images
    for image in each.values():
        assert np.all(image.shaded[::4, ::4])
        np.testing.assert_allclose(image.value[image.shaded], truth.value[image.shaded], atol=1e-12)
        assert np.all(np.isfinite(image.value))


def test_the_sky_is_not_smeared_into_the_floor(images):
    """Across the horizon and the sphere's limb the image jumps; interpolated pixels do not mix."""
    truth, each = images
    sky = truth.label == -1
    assert sky.any()
    for image in each.values():
        np.testing.assert_array_equal(image.value[sky], truth.value[sky])
        assert np.max(np.abs(image.value - truth.value)[~sky]) < 0.1


def test_interpolated_gradients_follow_the_true_ones(images):
    truth, each = images
    floor = whole(truth.label) & (truth.label == 6)
    scale = rms(truth.gradient[floor])
    assert rms((each["hermite"].gradient - truth.gradient)[floor]) < 0.2 * scale
