"""Each example runs as a user runs it, and prints what another computation says."""

import ast
import itertools
import pathlib
import re
import runpy

import jax
import numpy as np
import pytest
from scipy.spatial import ConvexHull

from firstorder import space
from firstorder.checks import check
from firstorder.transport import Event

FOLDER = pathlib.Path(__file__).parents[1] / "examples"
NUMBER = re.compile(r"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")


def numbers(text):
    return np.array([float(number) for number in NUMBER.findall(text)])


def shown(name, capsys):
    """What an example prints: the text before the first number of a line, and its numbers."""
    runpy.run_path(str(FOLDER / f"{name}.py"), run_name="__main__")
    return table(capsys.readouterr().out)


def table(text):
    """Lines by their first words; what a long array prints on further lines belongs to it."""
    found, key = {}, ""
    for line in text.splitlines():
        words = re.match(r"[a-zA-Z][a-zA-Z ]*", line)
        key = words.group().strip() if words else key
        found.setdefault(key, []).extend(numbers(line[words.end() if words else 0 :]))
    return {key: np.array(values) for key, values in found.items()}


def test_every_example_is_short_and_tested():
    files = sorted(f.stem for f in FOLDER.glob("*.py"))
    assert all(len((FOLDER / f"{f}.py").read_text().splitlines()) < 40 for f in files)
    tests = pathlib.Path(__file__).read_text()
    assert [f for f in files if f'"{f}' not in tests] == []


def test_light_through_a_path_is_a_bell_seen_along_the_mirror_direction(capsys):
    found = shown("light_through_a_path", capsys)
    x, theta = 0.3, -0.1
    variance = np.array([0.25, 0.3**2 + 0.2**2])  # two bells convolved
    J = np.array([[1.0, 0.0], [0.8, -1.0]])  # (x, 2 kappa x - theta)
    away = J @ [x, theta] - [0.2, 0.1]
    B = 0.3 / np.sqrt(variance[1]) * np.exp(-0.5 * np.sum(away**2 / variance))
    slope = J.T @ (-away / variance)
    np.testing.assert_allclose(found["value"], B, rtol=1e-7)
    np.testing.assert_allclose(found["gradient"], B * slope, rtol=1e-7)
    bend = np.outer(slope, slope) - J.T @ np.diag(1.0 / variance) @ J
    np.testing.assert_allclose(found["hessian"], B * bend.ravel(), rtol=1e-7)
    np.testing.assert_allclose(found["integral"], 2.0 * np.pi * 0.5 * 0.3, rtol=1e-7)
    spread = J.T @ np.diag(1.0 / variance) @ J / (8.0 * np.pi**2)
    np.testing.assert_allclose(found["covariance of the spectrum"], spread.ravel(), rtol=1e-6)


def test_equations_of_a_path_are_the_papers(capsys):
    runpy.run_path(str(FOLDER / "equations_of_a_path.py"), run_name="__main__")
    text = capsys.readouterr().out
    assert "2*L_theta(x, _t - theta + 2*n(x))*n_x(x)*rho(_t)" in text  # R07 (25), CDV
    assert "spectrum after travel: L_hat(Omega_x, Omega_v + Omega_x*d)" in text  # D05 (3)
    x, v = 0.5 - 2.0 * 0.2, 0.2
    L = np.exp(-0.5 * (x**2 + v**2 / 0.25))
    slope = -L * np.array([x, v / 0.25])
    found = numbers(text.splitlines()[-1])
    np.testing.assert_allclose(found, [slope[0], slope[1] - 2.0 * slope[0]], rtol=1e-6)


def test_own_events_are_five_of_a_few_lines_each(capsys):
    script = FOLDER / "own_events.py"
    run = runpy.run_path(str(script), run_name="__main__")
    text = capsys.readouterr().out
    assert "lens: L(x, theta + 2*x)" in text
    assert "haze: exp(-3/(5*cos(theta)))*L(x, theta)" in text
    assert "glass: L(x, asin(3*sin(theta)/2))" in text
    # Its energy beyond, by another transform: the FFT of samples far beyond both ends.
    h = 1e-3
    x = np.arange(-(2**15), 2**15) * h
    p = np.where(np.abs(x) < np.pi / 2, np.cos(x) ** 8 * (1 + 0.3 * x**2), 0.0)
    power = np.abs(np.fft.fft(p)) ** 2
    beyond = np.abs(np.fft.fftfreq(x.size, h)) > numbers(text.splitlines()[-1])[1]
    assert abs(np.sum(power[beyond]) / np.sum(power) - 0.01) < 0.002  # a sample more or less
    events = {k: e for k, e in run.items() if isinstance(e, Event) and k != "one"}
    assert set(events) == {"lens", "haze", "satin", "glass", "blocker"}
    for node in ast.parse(script.read_text()).body:
        if isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") in events:
            assert (node.end_lineno or 0) - node.lineno < 5
    report = check(events["lens"], name="lens")  # the others: tests/checks/test_own_events.py
    assert report.sound, str(report)


# --- the same script in two worlds ---------------------------------------------------------------


def lambert(corners, at, normal):
    """Irradiance over radiance from a polygon: the sum of its edges' angles, Lambert 1760."""
    r = (corners - at) / np.linalg.norm(corners - at, axis=1)[:, None]
    after = np.roll(r, -1, 0)
    cross = np.cross(r, after)
    size = np.linalg.norm(cross, axis=1)
    angle = np.arctan2(size, np.sum(r * after, 1))
    return abs(0.5 * np.sum(angle / size * (cross @ normal)))


def below_in_space(at, normal):
    """The lamp's lower face without what the box hides of it: the hull of the box's shadow."""
    low, high = (0.1, 0.1, 0.4), (0.2, 0.2, 0.5)
    box = np.array(list(itertools.product(*zip(low, high, strict=True))))
    shadow = at + (box - at) * ((1.0 - at[2]) / (box[:, 2] - at[2]))[:, None]
    shadow = shadow[ConvexHull(shadow[:, :2]).vertices]
    assert np.all(np.abs(shadow[:, :2]) < 0.5)
    lamp = np.array([(-0.5, -0.5, 1.0), (0.5, -0.5, 1.0), (0.5, 0.5, 1.0), (-0.5, 0.5, 1.0)])
    return lambert(lamp, at, normal) - lambert(shadow, at, normal)


def below_in_flatland(at, normal):
    """The lamp's lower edge without what the box hides of it."""

    def sines(points):
        way = np.array(points) - at
        return (way[:, 0] * normal[1] - way[:, 1] * normal[0]) / np.linalg.norm(way, axis=1)

    lamp, box = (
        sines([(-0.5, 1.0), (0.5, 1.0)]),
        sines(list(itertools.product((0.1, 0.2), (0.4, 0.5)))),
    )
    return np.ptp(lamp) - np.ptp(box)


def differences(E, freedoms, h=1e-4):
    """Value, gradient and Hessian of a function of all freedoms by central differences."""
    zero, step = np.zeros(freedoms), h * np.eye(freedoms)
    gradient = [(E(zero + s) - E(zero - s)) / (2.0 * h) for s in step]
    hessian = [
        [(E(s + t) - E(s - t) - E(t - s) + E(-s - t)) / (4.0 * h**2) for t in step] for s in step
    ]
    return E(zero), np.array(gradient), np.array(hessian)


def moved_in_space(u):
    tilt = np.hypot(u[3], u[4])
    side = np.sin(tilt) / tilt if tilt > 0.0 else 1.0
    normal = np.array([*(side * u[3:]), np.cos(tilt)])
    return below_in_space(np.array([0.25, 0.25, 0.0]) + u[:3], normal)


def moved_in_flatland(u):
    return below_in_flatland(np.array([0.25, 0.0]) + u[:2], np.array([-np.sin(u[2]), np.cos(u[2])]))


def along_a_valley_in_space(x):
    """On the ball-shaped valley of 1/2 m, by the graph of its surface."""
    height = 0.5 - np.sqrt(0.25 - x @ x)
    normal = np.array([*(-x / 0.5), 1.0 - height / 0.5])
    return below_in_space(np.array([0.25 + x[0], 0.25 + x[1], height]), normal)


def along_a_valley_in_flatland(x):
    height = 0.5 - np.sqrt(0.25 - x[0] ** 2)
    normal = np.array([-x[0] / 0.5, 1.0 - height / 0.5])
    return below_in_flatland(np.array([0.25 + x[0], height]), normal)


WORLDS = {
    "flatland": (3, moved_in_flatland, 1, along_a_valley_in_flatland),
    "space": (5, moved_in_space, 2, along_a_valley_in_space),
}


@pytest.mark.parametrize("world", WORLDS)
def test_irradiance_with_derivatives_is_one_script_for_both_worlds(world, capsys):
    script = (FOLDER / "irradiance_with_derivatives.py").read_text()
    line = "from firstorder import flatland as world"
    assert script.count(line) == 1
    exec(compile(script.replace(line, line.replace("flatland", world)), "example", "exec"), {})
    found = table(capsys.readouterr().out)
    freedoms, moved, dimensions, along = WORLDS[world]
    E, gradient, hessian = differences(moved, freedoms)
    np.testing.assert_allclose(found["E"], E, rtol=1e-7)
    np.testing.assert_allclose(found["gradient"], gradient, rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(found["hessian"], hessian.ravel(), rtol=0.0, atol=2e-6)
    _, gradient, hessian = differences(along, dimensions)
    np.testing.assert_allclose(found["gradient in a valley"], gradient, rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(found["hessian in a valley"], hessian.ravel(), rtol=0.0, atol=2e-6)


# --- sweeps, caches and images -------------------------------------------------------------------


def lamp_share(x):
    """Irradiance at (x, 0) from the lamp from (-0.5, 1) to (0.5, 1) of unit radiance."""
    return (0.5 - x) / np.hypot(0.5 - x, 1.0) + (0.5 + x) / np.hypot(0.5 + x, 1.0)


def test_sweep_over_a_parameter_is_the_closed_form_of_a_disc(capsys):
    runpy.run_path(str(FOLDER / "sweep_over_a_parameter.py"), run_name="__main__")
    rows = np.array([numbers(line)[[0, 1, 2]] for line in capsys.readouterr().out.splitlines()])
    radius, E, slope = rows.T
    np.testing.assert_allclose(radius, np.linspace(0.05, 0.15, 5))
    # A disc of radius r, D away, hides the sines between angles m -+ arcsin(r / D): 2 cos(m) r / D.
    D = np.hypot(0.2, 0.5)
    np.testing.assert_allclose(slope, -2.0 * (0.5 / D) / D, rtol=0.0, atol=2e-9)
    np.testing.assert_allclose(E, lamp_share(0.3) + slope * radius, rtol=0.0, atol=2e-9)


def test_irradiance_cache_covers_the_floor_with_few_records(capsys):
    runpy.run_path(str(FOLDER / "irradiance_cache.py"), run_name="__main__")
    text = capsys.readouterr().out
    found = table(text)
    assert "covered True" in text
    assert 5 <= found["records"][0] <= 16
    worst = found["largest error"][0]
    assert 0.0 < worst < 0.02
    assert abs(found["at x"][-1] - lamp_share(-0.4)) <= worst


def test_image_on_a_budget_is_near_the_exact_one_and_knows_how_near(capsys):
    run = runpy.run_path(str(FOLDER / "image_on_a_budget.py"), run_name="__main__")
    found = table(capsys.readouterr().out)
    assert found["samples"] == 800
    expected, measured = found["expected error"][0], found["measured error"][0]
    assert 0.5 < expected / measured < 1.5
    # Every fifth pixel of the floor by exact silhouettes, in and out of the shadow.
    lamp, pixels = run["lamp"], run["hits"]
    light = space.primitive(
        space.rectangle(lamp.center, lamp.u, lamp.v), emission=(lamp.radiance, 0.0)
    )
    world = space.Scene.of(*run["world"], light)
    some = np.argwhere(pixels.index == run["scene"].named("floor")[0])[::5]
    at = pixels.position[tuple(some.T)]
    on = world.named("floor")[0]
    E = jax.lax.map(lambda x: space.irradiance(world, space.receiver(x, on=on)), at)
    exact = 0.7 / np.pi * np.asarray(E)
    assert np.ptp(exact) > 0.8 * np.max(exact), "no shadow among the pixels"
    truth, image = (a[tuple(some.T)] for a in (run["truth"], run["image"].value))
    # 256 stratified rays err by some 256^(-3/4) of the lamp, and stand for what it all sends.
    assert np.sqrt(np.mean((truth - exact) ** 2)) < 256**-0.75 * np.max(exact)
    off, known = (np.sqrt(np.mean((image - a) ** 2)) for a in (exact, truth))
    np.testing.assert_allclose(off, known, rtol=0.05)
    whole = np.sqrt(np.mean((run["image"].value - run["truth"]) ** 2)) / np.mean(run["truth"])
    np.testing.assert_allclose(measured, whole, rtol=1e-12)
    assert measured < 0.06


# --- mirrors and files ---------------------------------------------------------------------------


def sines_of(points, at):
    way = np.array(points) - at
    return way[:, 0] / np.linalg.norm(way, axis=1)


def off_the_mirror(foot, top):
    """The lamp's image behind the mirror, through the opening that the mirror is."""
    low, end, at = np.array([foot, 0.0]), np.array([top, 0.3]), np.array([0.2, 0.0])
    normal = np.array([0.3, foot - top]) / np.hypot(0.3, top - foot)
    lamp = np.array([(-0.5, 1.0), (-1.5, 1.0)])
    behind = lamp - 2.0 * ((lamp - low) @ normal)[:, None] * normal
    image, opening = np.sort(sines_of(behind, at)), np.sort(sines_of([low, end], at))
    return 0.8 * max(min(image[1], opening[1]) - max(image[0], opening[0]), 0.0)


def test_light_by_a_mirror_comes_from_the_lamp_behind_it(capsys):
    found = shown("light_by_a_mirror", capsys)
    h = 1e-5
    np.testing.assert_allclose(found["E"], off_the_mirror(1.0, 1.0), rtol=1e-12)
    foot, top = (
        (off_the_mirror(1.0 + a, 1.0 + b) - off_the_mirror(1.0 - a, 1.0 - b)) / (2.0 * h)
        for a, b in ((h, 0.0), (0.0, h))
    )
    np.testing.assert_allclose(found["by the foot of the mirror"], foot, rtol=1e-7)
    np.testing.assert_allclose(found["by its top"], top, rtol=1e-7)


def test_shadow_ray_file_holds_the_rays_that_tell_the_shadow(capsys):
    found = shown("shadow_ray_file", capsys)
    size, count = found["bytes"]
    assert count == 16 * 400
    assert size == 136 + 28 * count
    # Half-way up a sheet over x < 0 hides what is opposite: a share of x + 1/2 is left.
    share = np.clip(found["x"] + 0.5, 0.0, 1.0)
    np.testing.assert_allclose(found["share of the lamp"], share, rtol=0.0, atol=0.02)


def test_radiance_ambient_file_is_a_cache_that_covers_the_floor(capsys):
    found = shown("radiance_ambient_file", capsys)
    assert found["records"].tolist() == [64.0, 1.0]
    worst, brightest = found["largest error"]
    lamp = np.array([(-0.5, -0.5, 2.0), (0.5, -0.5, 2.0), (0.5, 0.5, 2.0), (-0.5, 0.5, 2.0)])
    most = lambert(lamp, np.zeros(3), np.array([0.0, 0.0, 1.0]))
    assert 0.98 * most < brightest < most
    assert 0.0 < worst < 0.02 * most


def test_cache_over_photons_errs_by_a_few_per_cent_with_a_thirtieth_of_the_places(capsys):
    found = shown("cache_over_photons", capsys)
    kept, places = found["records"]
    assert places == 2304
    assert kept < places / 20
    error, mean = found["rms error"]
    assert 0.0 < error < 0.05 * mean
    # Lambert's sum over the lamp's edges at the brightest places of the wall, halved by its albedo.
    lamp = np.array([(0.3, 0.3, 1.0), (0.3, 0.7, 1.0), (0.7, 0.7, 1.0), (0.7, 0.3, 1.0)])
    heights = [wall_irradiance(lamp, z) for z in np.linspace(0.5, 0.999, 200)]
    most = 0.5 / np.pi * max(heights)
    assert most < found["brightest"][0] < most * (1.0 + 4.0 / np.sqrt(300))


def test_cache_with_shadow_lines_errs_less_at_as_many_records(capsys):
    blind, knowing = shown("cache_with_shadow_lines", capsys)["rms error of"][1::2]
    assert 0.0 < knowing < 0.8 * blind < 0.01  # of an irradiance of some 0.5


def test_cache_of_second_order_errs_less_at_as_many_records(capsys):
    found = shown("cache_of_second_order", capsys)
    first, second = found["rms error of"][2::3]
    assert 0.0 < second < 0.92 * first < 0.04 * found["mean irradiance"][0]


def wall_irradiance(lamp, z):
    """Irradiance of the wall x = 0 in the middle of its depth, at a height."""
    turned = lamp[:, [1, 2, 0]] - np.array([0.5, z, 0.0])  # the wall's normal comes last
    return lambert(turned, np.zeros(3), np.array([0.0, 0.0, 1.0]))


def test_a_wrong_number_is_noticed():
    """The oracle of the two worlds tells another lamp apart."""
    E, gradient, _ = differences(moved_in_flatland, 3)
    other, turned, _ = differences(lambda u: moved_in_flatland(u + 0.01 * np.eye(3)[0]), 3)
    assert abs(E - other) > 1e-3
    assert np.max(abs(gradient - turned)) > 1e-3
