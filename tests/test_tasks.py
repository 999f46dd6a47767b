"""Every script of the task pages runs, and leaves what another computation says."""

import pathlib
import re

import matplotlib.pyplot as plt
import numpy as np
import pytest

FOLDER = pathlib.Path(__file__).parents[1] / "docs" / "tasks"
PAGES = sorted(path.stem for path in FOLDER.glob("*.md"))
LAMP = (-0.5, 0.5, 1.0)


def scripts(page):
    text = (FOLDER / f"{page}.md").read_text(encoding="utf-8")
    return re.findall(r"```python\n(.*?)```", text, re.DOTALL)


@pytest.fixture
def ran(tmp_path, monkeypatch):
    """Runs a script of a page in a folder of its own, and returns the names that it leaves."""
    monkeypatch.chdir(tmp_path)

    def run(page, number=0):
        names = {}
        exec(compile(scripts(page)[number], page, "exec"), names)
        plt.close("all")
        return names

    return run


def closed(x, disc, lamp=LAMP):
    """Irradiance of a floor under a lamp and a disc: sines of angles, what both hide once."""
    left, right, height = lamp
    low, high = ((end - x) / np.hypot(end - x, height) for end in (left, right))
    middle = np.arctan2(disc[0] - x, disc[1])
    half = np.arcsin(disc[2] / np.hypot(disc[0] - x, disc[1]))
    hidden = np.minimum(high, np.sin(middle + half)) - np.maximum(low, np.sin(middle - half))
    return high - low - np.maximum(hidden, 0.0)


def lambert(corners, at):
    """Irradiance over radiance of a polygon above a floor: the sum of its edges' angles."""
    r = (corners - at) / np.linalg.norm(corners - at, axis=1)[:, None]
    cross = np.cross(r, np.roll(r, -1, 0))
    size = np.linalg.norm(cross, axis=1)
    angle = np.arctan2(size, np.sum(r * np.roll(r, -1, 0), 1))
    return abs(0.5 * np.sum(angle / size * cross[:, 2]))


def test_every_page_with_a_script_of_its_own_has_a_test_and_is_listed():
    source = pathlib.Path(__file__).read_text(encoding="utf-8")
    assert [p for p in PAGES for k in range(len(scripts(p))) if f'ran("{p}"' not in source] == []
    listed = (FOLDER / "index.md").read_text(encoding="utf-8")
    assert [p for p in PAGES if p != "index" and f"]({p}.md)" not in listed] == []


def test_pages_without_a_script_of_their_own_show_an_example():
    shown = {
        p: re.findall(r"literalinclude\} \.\./\.\./(.*)", (FOLDER / f"{p}.md").read_text())
        for p in PAGES
    }
    assert [p for p in PAGES if p != "index" and not scripts(p) and not shown[p]] == []
    root = FOLDER.parents[1]
    assert [f for files in shown.values() for f in files if not (root / f).is_file()] == []


def test_the_curve_along_the_floor_is_the_closed_form(ran, tmp_path):
    curve = ran("floor")["curve"]
    disc, x, h = (0.1, 0.5, 0.1), curve["x"], 1e-5
    np.testing.assert_allclose(curve["E"], closed(x, disc), rtol=0.0, atol=1e-12)
    clear = (x > -0.05) & (x < 0.4)  # where both parts of the lamp are seen
    slope = (closed(x + h, disc) - closed(x - h, disc)) / (2.0 * h)
    np.testing.assert_allclose(curve["dE"][clear], slope[clear], rtol=0.0, atol=1e-8)
    assert (tmp_path / "floor.png").read_bytes()[:4] == b"\x89PNG"


def test_the_gradient_in_the_blocker_is_that_of_twice_the_radius_over_the_height(ran):
    names = ran("blocker")
    h, r = 0.5, 0.1  # below the middle the disc hides 2 r h / (x^2 + h^2)
    np.testing.assert_allclose(names["E"], closed(0.1, (0.1, h, r)), rtol=1e-12)
    np.testing.assert_allclose(
        names["by_disc"], [0.0, 2.0 * r / h**2, -2.0 / h], rtol=0.0, atol=1e-12
    )
    bends = [[4.0 * r / h**3, 0, 0], [0, -4.0 * r / h**3, 2.0 / h**2], [0, 2.0 / h**2, 0]]
    np.testing.assert_allclose(names["bends"], bends, rtol=0.0, atol=1e-10)


def test_many_receivers_get_the_lamp_without_the_ball(ran):
    names = ran("receivers")
    E, places = np.asarray(names["E"]).reshape(12, 12), names["places"].reshape(12, 12, 3)
    np.testing.assert_allclose(E, E[:, ::-1], rtol=1e-10)
    corners = np.array([(-0.5, -0.5, 1.0), (0.5, -0.5, 1.0), (0.5, 0.5, 1.0), (-0.5, 0.5, 1.0)])
    np.testing.assert_allclose(E[0, 0], lambert(corners, places[0, 0]), rtol=1e-10)
    below = places[8, 5]  # the whole ball is before the lamp
    way = np.array([0.2, 0.0, 0.5]) - below
    ball = np.pi * 0.1**2 * way[2] / np.linalg.norm(way) ** 3
    np.testing.assert_allclose(E[8, 5], lambert(corners, below) - ball, rtol=1e-8)


def test_the_disc_is_found_again_in_bounds(ran):
    np.testing.assert_allclose(ran("inverse")["found"].x, [0.15, 0.5, 0.13], rtol=0.0, atol=1e-8)


def test_a_free_radius_ends_where_the_light_is_as_wanted(ran):
    radius = float(ran("inverse", 1)["radius"])
    np.testing.assert_allclose(radius, (1.0 / np.hypot(0.5, 1.0) - 0.8) / 4.0, rtol=1e-4)


def lamp_light(x, y, n, distance, material, eye=0.4):
    """What an eye sees of a floor by each of albedo, gloss and the width, by Gauss's rule."""
    albedo, gloss, width = material
    ends = [np.arctan2(x - side * distance, distance - y) for side in (0.4, 0.2)]
    t, w = np.polynomial.legendre.leggauss(48)
    half = 0.5 * (ends[1] - ends[0])[:, None]
    theta = 0.5 * (ends[1] + ends[0])[:, None] + half * t  # in the world, counter-clockwise
    off = (theta - n[:, None]) + (eye - n[:, None])
    lobe, cos = np.exp(-0.5 * (off / width) ** 2), np.cos(theta - n[:, None])
    columns = 0.5 * albedo * cos, gloss * lobe * cos, gloss * lobe * (off / width) ** 2 * cos
    return np.stack([np.sum(half * w * column, 1) for column in columns], -1)


def test_near_light_tells_a_material_on_a_flat_floor_and_distant_light_does_not(ran):
    names = ran("inverse", 2)
    x, true = names["x"], np.asarray(names["true"])
    flat, bent = (x, 0.0 * x, 0.0 * x), (np.sin(x), np.cos(x) - 1.0, -x)
    for d, row in zip(names["distances"], names["table"], strict=True):
        for shape, (condition, off) in zip((flat, bent), (row[:2], row[2:]), strict=True):
            J = lamp_light(*shape, d, true)  # relative derivatives by the material
            light, steps = (J[:, 0] + J[:, 1]), (1e-3 * d, -1e-3 * d)
            further, nearer = (lamp_light(*shape, d + h, true)[:, :2].sum(1) for h in steps)
            both = np.column_stack([J, (further - nearer) / 2e-3])
            spread = np.linalg.norm(np.linalg.pinv(both)[3]) * 0.01 * np.sqrt(np.mean(light**2))
            np.testing.assert_allclose(condition, np.linalg.cond(J), rtol=1e-5)
            np.testing.assert_allclose(off, spread, rtol=1e-3)
    one, off, other, bent_off = names["table"].T
    assert abs(np.log(one[-1] / one[-2]) / np.log(4.0) - 2.0) < 0.01
    assert max(other) < 1.1 * min(other)
    assert list(off < bent_off) == [True, True, False, False]
    far = np.linalg.svd(lamp_light(*flat, 1e6, true), compute_uv=False)
    assert far[1] < 1e-5 * far[0]
    J = lamp_light(*flat, 0.5, true)
    spread = np.linalg.pinv(J) * 0.01 * (J[:, 0] + J[:, 1])
    assert np.all(np.abs(names["found"].x / true - 1.0) < 3.0 * np.sqrt(np.sum(spread**2, 1)))


def test_a_drawing_in_centimetres_is_a_scene_in_metres(ran):
    names = ran("drawing")
    found = names["irradiance"](names["scene"], names["Receiver"].at((2.0, 0.0)))
    np.testing.assert_allclose(found, closed(2.0, (2.6, 1.0, 0.2), (1.5, 2.5, 2.0)), rtol=1e-12)


def test_what_a_mesh_leaves_free_is_all_but_the_solid_angle_of_the_sheet(ran):
    names = ran("mesh")

    def sheet(x):
        """Solid angle of the square: a corner term for each of its four rectangles."""
        a = np.stack(np.meshgrid([-1.0 - x[0], 1.0 - x[0]], [-1.0 - x[1], 1.0 - x[1]]), -1)
        up = 1.0 - x[2]
        u, v = a[..., 0], a[..., 1]
        corner = np.arctan(u * v / (up * np.sqrt(u**2 + v**2 + up**2)))
        return corner[1, 1] - corner[0, 1] - corner[1, 0] + corner[0, 0]

    place, h = names["place"], 1e-5
    np.testing.assert_allclose(names["V"], 2.0 * np.pi - sheet(place), rtol=1e-10)
    slope = [(sheet(place - e) - sheet(place + e)) / (2.0 * h) for e in h * np.eye(3)]
    np.testing.assert_allclose(names["gradient"], slope, rtol=0.0, atol=1e-8)


def test_light_under_a_lamp_and_a_mesh_is_that_of_rays(ran):
    names = ran("mesh", 1)
    middle = (np.arange(400) + 0.5) / 400 - 0.5
    place = np.array([0.1, 0.05, 0.0])
    x, y = np.meshgrid(middle, middle, indexing="ij")
    rays = np.stack([x, y, 2.0 + 0.0 * x], -1).reshape(-1, 3) - place
    form = 3.0 * 4.0 / np.sum(rays**2, -1) ** 2 / rays.shape[0]
    corners = np.asarray(names["spike"].corners) - place
    inside = [np.all(rays @ np.linalg.inv(face) > 0.0, -1) for face in corners]
    np.testing.assert_allclose(names["E"], np.sum(form * ~np.any(inside, 0)), rtol=2e-3)
    # Higher, the mesh hides less; a higher place is nearer to it.
    assert names["by_mesh"][2] > 0.0 > names["by_place"][2]


def test_the_adaptive_image_is_nearer_the_truth_than_an_even_one(ran):
    names = ran("image")
    size, budget = names["size"], names["budget"]
    middle = np.arange(size) + 0.5
    x, y = np.meshgrid(middle, middle, indexing="ij")
    truth = closed(2.0 * x / size - 1.0, (0.0 * x, 0.1 + 0.8 * y / size, 0.1))
    assert len(names["found"].p) == budget
    even = names["reconstruction"].sample_image(
        names["shade"], size, size, budget, names["reconstruction"].by_area
    )
    rebuilt = names["reconstruction"].delaunay_image(
        even.p, even.value, size, size, gradient=even.gradient
    )
    errors = [np.sqrt(np.mean((np.asarray(i) - truth) ** 2)) for i in (names["image"], rebuilt)]
    assert errors[0] < 0.6 * errors[1]
    assert errors[0] < 0.02 * truth.mean()


def test_files_hold_what_was_written(ran, tmp_path):
    names = ran("files")
    assert all(names["jax"].tree.leaves(names["same"]))
    table = np.genfromtxt(tmp_path / "results.csv", delimiter=",", names=True)
    np.testing.assert_array_equal(table["E"], np.cos(names["x"]))
    np.testing.assert_array_equal(np.load(tmp_path / "results.npz")["x"], names["x"])


def test_single_precision_stays_single_and_costs_what_the_page_says(ran):
    names = ran("float32")
    (one, slope), (two, exact) = names["single"], names["double"]
    assert [a.dtype for a in (one, slope, two, exact)] == ["float32"] * 2 + ["float64"] * 2
    np.testing.assert_allclose(two, closed(0.3, (0.1, 0.5, 0.1)), rtol=1e-12)
    assert abs(one - two) < 1e-6 * two
    assert abs(slope - exact) < 1e-4 * abs(exact)


def test_receivers_spread_over_devices_get_the_same_light(ran):
    names = ran("devices")
    expected = closed(names["places"][:, 0], (0.1, 0.5, 0.1))
    np.testing.assert_allclose(names["E"], expected, rtol=0.0, atol=1e-12)
    assert len(names["E"].sharding.device_set) == len(names["devices"])


def test_later_calls_do_not_compile(ran):
    first, *later = ran("compilation")["seconds"]
    assert max(later) < 0.1 * first


def test_a_slice_of_an_endless_scene_is_flatland_times_half_pi(ran):
    names = ran("slice")
    flat = 2.0 * 0.5 / np.hypot(0.5, 1.0)  # twice the sine of half the lamp's angle
    np.testing.assert_allclose(names["flat"], flat, rtol=1e-12)
    for depth, found in zip((0.5, 5.0, 50.0), np.asarray(names["slices"]), strict=True):
        corners = np.array([(a, b, 1.0) for a, b in ((-0.5, -depth), (0.5, -depth),
                            (0.5, depth), (-0.5, depth))])  # fmt: skip
        np.testing.assert_allclose(found, lambert(corners, np.zeros(3)), rtol=1e-10)
    assert abs(names["slices"][-1] / flat / (0.5 * np.pi) - 1.0) < 1e-3
    np.testing.assert_allclose(names["fall"], 0.5, rtol=1e-4)
    np.testing.assert_allclose(names["steeper"], 0.25, rtol=1e-4)


def test_the_light_that_leaves_the_slice_goes_through_its_front_and_back(ran):
    """The lamp's irradiance of the two open sides of the box, integrated by Gauss's rule."""
    t, w = np.polynomial.legendre.leggauss(24)
    x, z = 0.5 * (t[:, None] + 1.0), 0.5 * (t + 1.0)
    lamp = np.array([(0.3, 0.3, 1.0), (0.7, 0.3, 1.0), (0.7, 0.7, 1.0), (0.3, 0.7, 1.0)])
    turned = lamp[:, [0, 2, 1]]  # the open side's normal comes last
    E = [[lambert(turned, np.array([a, b, 0.0])) for b in z] for a in x[:, 0]]
    through = 2.0 * 0.25 * w @ np.array(E) @ w / (np.pi * 0.16)
    spread = np.sqrt(through * (1.0 - through) / 100_000)
    assert abs(ran("slice")["left"] - through) < 4.0 * spread


def test_three_meanings_of_locality_are_measured(ran):
    names, disc = ran("locality"), (0.1, 0.5, 0.1)
    x, h = -1.0, 1e-3
    bend = (closed(x + h, disc) - 2.0 * closed(x, disc) + closed(x - h, disc)) / h**2
    np.testing.assert_allclose(names["at"].hessian[0, 0, 0], bend, rtol=1e-4)
    share = names["error"] / (0.5 * bend * names["h"] ** 2)
    assert np.all(np.abs(share - 1.0) < 0.1)
    assert np.all(np.diff(np.abs(share - 1.0)) > 0.0)  # the next term, which grows with h
    np.testing.assert_allclose(names["product"], 1.0 / (4.0 * np.pi), rtol=1e-12)
    assert names["inside"] > 2.0 * names["bend"].mean() > 4.0 * names["outside"]
