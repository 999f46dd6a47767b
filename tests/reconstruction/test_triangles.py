"""Images from triangles: of planes and parabolas, and by barycentric coordinates one by one."""

import numpy as np
import pytest
import scipy.spatial

from firstorder import reconstruction
from firstorder.reconstruction import _triangles as triangles

WIDTH, HEIGHT = 9, 7
RNG = np.random.default_rng(8)
HULL = np.array([[-1.0, -2.0], [11.0, -1.5], [10.0, 9.0], [-2.0, 8.0], [4.0, 9.5], [4.5, -3.0]])
P = np.concatenate([HULL, RNG.uniform(0.0, 1.0, (14, 2)) * [WIDTH, HEIGHT]])
DELAUNAY = scipy.spatial.Delaunay(P)
PIXEL = np.stack(np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT), indexing="ij"), -1) + 0.5
Q = np.array([[0.3, -0.2], [-0.2, 0.5]])


def parabola(p):
    return 1.0 + p @ [0.5, -0.7] + np.einsum("...i,ij,...j->...", p, Q, p)


def gradient(p):
    return np.array([0.5, -0.7]) + 2.0 * p @ Q


def image(at, scheme="linear", labels=None, triangle=DELAUNAY.simplices, sloped=None):
    sloped = at.gradient is not None if sloped is None else sloped
    return triangles.blended(at, triangle, WIDTH, HEIGHT, labels, scheme, sloped)


def weights():
    """Corners and weights of each pixel, one linear system at a time."""
    found = DELAUNAY.find_simplex(PIXEL.reshape(-1, 2))
    corners = DELAUNAY.simplices[found]
    ones = np.ones(3)
    return corners, np.array(
        [
            np.linalg.solve(np.vstack([P[c].T, ones]), [*x, 1.0])
            for c, x in zip(corners, PIXEL.reshape(-1, 2), strict=True)
        ]
    )


@pytest.mark.parametrize("flip", [False, True])
def test_values_are_blended_by_barycentric_coordinates(flip):
    """Whichever way the triangles turn."""
    value = RNG.normal(size=len(P))
    simplices = DELAUNAY.simplices[:, ::-1] if flip else DELAUNAY.simplices
    corners, weight = weights()
    found = image(triangles.vertices(P, value, None, None), triangle=simplices)
    assert found.shape == (WIDTH, HEIGHT)
    np.testing.assert_allclose(found.ravel(), np.sum(value[corners] * weight, -1), rtol=1e-9)


def test_gradients_blend_parabolas_exactly():
    """Half of each tangent: `f(x) = f_i + (f'_i + f'(x)) (x - p_i) / 2`."""
    at = triangles.vertices(P, parabola(P), gradient(P), None)
    np.testing.assert_allclose(image(at, "gradient"), parabola(PIXEL), rtol=1e-9)
    plain = triangles.vertices(P, parabola(P), None, None)
    np.testing.assert_allclose(image(at, "linear"), image(plain), rtol=1e-12)
    np.testing.assert_allclose(image(at, "gradient", sloped=False), image(plain), rtol=1e-12)


def test_corners_that_show_something_else_drop_out():
    """A plane for each label: what is left of the corners goes on by its tangents."""
    label = (P[:, 0] > 4.2).astype(int)
    value = np.where(label == 1, 5.0 + P @ [1.0, 2.0], -3.0 - P @ [0.5, 0.1])
    slope = np.where(label[:, None] == 1, [1.0, 2.0], [-0.5, -0.1])
    labels = (PIXEL[..., 0] > 4.2).astype(int)
    at = triangles.vertices(P, value, slope, label)
    true = np.where(labels == 1, 5.0 + PIXEL @ [1.0, 2.0], -3.0 - PIXEL @ [0.5, 0.1])
    for scheme in triangles.SCHEMES:
        np.testing.assert_allclose(image(at, scheme, labels), true, rtol=1e-9)
    corners, weight = weights()
    weight = weight * (label[corners] == labels.reshape(-1, 1))
    flat = triangles.vertices(P, value, None, label)
    some = weight.sum(1) > 1e-9
    blend = np.sum(weight * value[corners], 1)[some] / weight.sum(1)[some]
    np.testing.assert_allclose(image(flat, labels=labels).ravel()[some], blend, rtol=1e-9)


def test_a_pixel_without_a_corner_takes_the_nearest_sample_of_its_label():
    """Pixels away from both samples that show a label, and one of a label that none shows."""
    label, own = np.zeros(len(P), int), [7, 11]
    label[own] = 3
    corners, _ = weights()
    away = np.flatnonzero(~np.any(np.isin(corners, own), axis=1))
    labels = np.zeros(WIDTH * HEIGHT, int)
    labels[away[::4]], labels[away[1]] = 3, 9
    value, slope = RNG.normal(size=len(P)), RNG.normal(size=(len(P), 2))
    at = triangles.vertices(P, value, slope, label)
    found = image(at, labels=labels.reshape(WIDTH, HEIGHT)).ravel()
    for pixel in [*away[::4], away[1]]:
        x, among = PIXEL.reshape(-1, 2)[pixel], own if labels[pixel] == 3 else range(len(P))
        near = min(among, key=lambda k, x=x: np.linalg.norm(P[k] - x))
        np.testing.assert_allclose(
            found[pixel], value[near] + slope[near] @ (x - P[near]), rtol=1e-9
        )


def test_pixels_that_no_triangle_covers_take_the_nearest_sample():
    one = np.array([[0.0, 0.0], [4.0, 0.0], [0.0, 4.0]])
    value = np.array([1.0, 2.0, 3.0])
    found = triangles.blended(
        triangles.vertices(one, value, None, None),
        np.array([[0, 1, 2]]),
        5,
        5,
        None,
        "linear",
        False,
    )
    np.testing.assert_allclose(found[0, 0], 1.0 + 0.5 / 4 + 2 * 0.5 / 4)
    assert found[4, 4] in (2.0, 3.0)
    assert found[4, 1] == 2.0
    assert found[1, 4] == 3.0


def test_a_sample_at_the_centre_of_a_pixel_is_its_value():
    """Also on an edge of triangles of no area, and at the last pixel."""
    p = np.array(
        [[0.5, 0.5], [2.5, 0.5], [4.5, 0.5], [4.5, 3.5], [1.5, 2.5], [0.5, 3.5], [5.5, 1.5]]
    )
    flat = np.array([[0, 1, 2], [0, 1, 4], [1, 2, 4], [2, 3, 4], [0, 4, 5], [3, 4, 5]])
    value = np.arange(7.0) + 1.0
    at = triangles.vertices(p, value, None, None)
    found = triangles.blended(at, flat, 5, 4, None, "linear", False)
    for k in range(6):
        i, j = (p[k] - 0.5).astype(int)
        assert found[i, j] == value[k]
    assert np.all(np.isfinite(found))
    np.testing.assert_allclose(found[1, 0], 1.5)


def test_mirrored_samples_go_on_by_their_tangents():
    at = triangles.vertices(
        P, P @ [2.0, -3.0] + 1.0, np.tile([2.0, -3.0], (len(P), 1)), np.arange(len(P))
    )
    rows = np.array([6, 9])
    found = triangles.mirror_across(at, rows, 1, 7.0)
    image = P[rows] * [1.0, -1.0] + [0.0, 14.0]
    np.testing.assert_allclose(found.p, np.concatenate([P, image]))
    np.testing.assert_allclose(found.value, found.p @ [2.0, -3.0] + 1.0)
    np.testing.assert_allclose(found.gradient, np.tile([2.0, -3.0], (len(P) + 2, 1)))
    assert found.label.tolist() == [*range(len(P)), 6, 9]
    assert triangles.mirror_across(at._replace(label=None), rows, 0, 0.0).label is None
    np.testing.assert_allclose(
        triangles.mirror_across(at, rows, 0, 0.0).p[-2:], P[rows] * [-1.0, 1.0]
    )


def test_planes_through_samples_are_fitted_to_their_neighbours():
    at = triangles.vertices(P, P @ [2.0, -3.0] + 1.0, None, None)
    rows = np.array([3, 10, 15])
    np.testing.assert_allclose(triangles.planes(at, rows), np.tile([2.0, -3.0], (3, 1)), rtol=1e-9)
    # Least squares weighted by one over the square of the distance, to the eight nearest.
    at = triangles.vertices(P, parabola(P), None, None)
    for row in rows:
        d = P - P[row]
        near = np.argsort(np.linalg.norm(d, axis=1))[1:9]
        root = 1.0 / np.linalg.norm(d[near], axis=1)
        true = np.linalg.lstsq(
            d[near] * root[:, None], (parabola(P[near]) - parabola(P[row])) * root
        )[0]
        np.testing.assert_allclose(triangles.planes(at, np.array([row]))[0], true, rtol=1e-9)


def test_neighbours_of_another_label_and_those_in_line_fit_no_plane():
    label = (P[:, 0] > 4.2).astype(int)
    value = np.where(label == 1, 50.0 + P @ [1.0, 2.0], P @ [0.5, 0.1])
    at = triangles.vertices(P, value, None, label)
    (row,) = np.flatnonzero(label == 1)[:1]
    np.testing.assert_allclose(triangles.planes(at, np.array([row])), [[1.0, 2.0]], rtol=1e-9)
    line = np.array([[0.0, 0.0], [1.0, 2.0], [2.0, 4.0], [3.0, 6.0]])
    flat = triangles.vertices(line, line[:, 0], None, None)
    assert triangles.planes(flat, np.array([1])).tolist() == [[0.0, 0.0]]


def test_what_does_not_fit_together_is_refused():
    at = triangles.vertices(P, parabola(P), gradient(P), np.zeros(len(P)))
    with pytest.raises(ValueError, match="`labels`"):
        image(at, labels=np.zeros((HEIGHT, WIDTH)))
    for name, given in [
        ("value", (P, np.ones(1), None, None)),
        ("gradient", (P, parabola(P), P[:2], None)),
        ("label", (P, parabola(P), None, np.ones(1))),
    ]:
        with pytest.raises(ValueError, match=f"`{name}`"):
            triangles.vertices(*given)
    with pytest.raises(ValueError, match="`scheme` must be one of"):
        triangles.check_scheme("cubic", None, None, None)
    with pytest.raises(ValueError, match="`gradient` is needed"):
        triangles.check_scheme("gradient", None, None, None)
    for pair in [([1], None), (None, [1])]:
        with pytest.raises(ValueError, match="must come together"):
            triangles.check_scheme("linear", None, *pair)
    triangles.check_scheme("linear", None, None, None)
    triangles.check_scheme("gradient", P, [1], [1])


@pytest.mark.parametrize("sloped", [False, True])
def test_what_is_no_number_on_another_object_does_not_leak(sloped):
    p = np.random.default_rng(0).uniform(0.0, 8.0, (40, 2))
    sky = p[:, 0] > 4.0
    pixels = np.repeat((np.arange(8)[:, None] >= 4).astype(int), 8, 1)

    def image(elsewhere):
        value = np.where(sky, elsewhere, p[:, 1])
        slope = np.where(sky[:, None], elsewhere, (0.0, 1.0)) if sloped else None
        return reconstruction.delaunay_image(
            p, value, 8, 8, gradient=slope, label=sky.astype(int), labels=pixels
        )

    np.testing.assert_array_equal(image(np.nan)[:4], image(0.0)[:4])
    assert np.isfinite(image(np.nan)[:4]).all()
