"""Comparisons with other programs: they run, with what is there, and truth is nobody's own."""

import importlib
import json

import jax.numpy as jnp
import numpy as np
import pytest

from benchmarks.peers import (
    contenders,
    gradients,
    measure,
    radiance,
    reference,
)
from benchmarks.peers.__main__ import NAMES, RESULTS, keep, main, run
from benchmarks.peers.soft_shadows import QUESTIONS, SHADOWS
from docs.generate import peers as page
from firstorder.io import space_from_mitsuba, space_to_mitsuba
from firstorder.space import Receiver, irradiance, library

PEERS = ("pyradiance", "mitsuba", "numba")


@pytest.fixture
def alone(monkeypatch):
    """A machine without any of the others."""
    there = measure.is_there
    monkeypatch.setattr(measure, "is_there", lambda p: p not in PEERS and there(p))
    monkeypatch.setattr("benchmarks.bench_flatland.numba_form", lambda: None)


# --- truth ---------------------------------------------------------------------------------------


def ours(shadow, place):
    scene = shadow.scene()
    return irradiance(scene, Receiver.at(jnp.append(place, 0.0), on=scene.named("floor")[0])).item()


@pytest.mark.parametrize("name", SHADOWS)
def test_quadrature_of_rows_is_our_irradiance(name):
    shadow = SHADOWS[name]
    for place in np.asarray(shadow.places):
        truth = reference.irradiance(shadow, place, np.zeros(2))
        assert abs(ours(shadow, jnp.asarray(place)) - truth) < 1e-10


@pytest.mark.slow
@pytest.mark.parametrize("question", QUESTIONS)
@pytest.mark.parametrize("name", SHADOWS)
def test_its_differences_are_our_gradient(name, question):
    shadow = SHADOWS[name]
    places = np.asarray(shadow.places[:3])
    truth = reference.gradients(shadow, places, question)
    (found,) = contenders.ways(shadow, places, question)[0].budgets[1](0)
    # What two steps say of the error, and what quadrature leaves of its own.
    np.testing.assert_allclose(found, truth.value, rtol=0.0, atol=truth.error + 1e-9)


def test_a_ball_a_little_too_large_is_seen(monkeypatch):
    monkeypatch.setattr(
        reference,
        "_seen_from",
        lambda body, x, y, step: reference._SeenBall(
            tuple(np.subtract(body.center, (x, y, 0.0))), 1.001 * body.radius
        ),
    )
    place = np.asarray(SHADOWS["ball"].places[0])
    truth = reference.irradiance(SHADOWS["ball"], place, np.zeros(2))
    assert abs(ours(SHADOWS["ball"], jnp.asarray(place)) - truth) > 1e-5


# --- the same scenes -----------------------------------------------------------------------------


@pytest.mark.parametrize("name", SHADOWS)
def test_what_mitsuba_gets_is_our_scene(name):
    scene = SHADOWS[name].scene()
    again = space_from_mitsuba(space_to_mitsuba(scene)).things
    assert {thing.name for thing in again} == {"floor", "lamp"} | {
        f"body{k}" for k in range(len(SHADOWS[name].bodies))
    }
    rows = [row for group in scene.groups for row in np.asarray(group.center)]
    found = [np.asarray(thing.shape.center)[0] for thing in again]
    for row in rows:
        assert min(np.abs(row - f).max() for f in found) == 0.0


@pytest.mark.parametrize("scene", [library.clutter(), *(s.scene() for s in SHADOWS.values())])
def test_what_radiance_gets_is_our_scene(scene):
    """Read back: corners of every polygon on its shape, and faces that look outwards."""
    lines = radiance.to_radiance(scene).splitlines()
    shapes = [
        (type(g).__name__, c, a)
        for g in scene.groups
        for c, a in zip(np.asarray(g.center), np.asarray(g.axes), strict=True)
    ]
    polygons = [line.split() for line in lines if " polygon " in line]
    assert sum(" sphere " in line for line in lines) == sum(k == "Ellipsoids" for k, _, _ in shapes)
    assert len(polygons) == sum({"Boxes": 6, "Rectangles": 1}.get(k, 0) for k, _, _ in shapes)
    for words in polygons:
        kind, center, axes = shapes[int(words[0][1:])]
        corners = np.array(words[6:], float).reshape(4, 3)
        q = (corners - center) @ np.linalg.inv(axes).T
        np.testing.assert_allclose(np.abs(q[:, :2]), 1.0, rtol=0.0, atol=1e-6)
        out = np.cross(corners[1] - corners[0], corners[2] - corners[1])
        ahead = corners.mean(0) - center if kind == "Boxes" else axes[:, 2]
        assert out @ ahead > 0.0


def test_radiance_gets_no_ellipsoid():
    from firstorder.space import Scene, disc, ellipsoid, primitive

    flat = ellipsoid((0.0, 0.0, 1.0), np.diag([1.0, 1.0, 0.5]))
    with pytest.raises(ValueError, match="must have balls"):
        radiance.to_radiance(Scene.of(primitive(flat)))
    with pytest.raises(ValueError, match="but has Discs"):
        radiance.to_radiance(Scene.of(primitive(disc((0.0, 0.0, 1.0), (0.0, 0.0, 1.0), 1.0))))


@pytest.mark.skipif(not measure.is_there("pyradiance"), reason="pyradiance is not installed")
def test_radiance_sees_what_we_see(tmp_path):
    shadow = SHADOWS["box"]
    places = np.asarray(shadow.places)
    octree = radiance.compiled(shadow.scene(), tmp_path)
    found = radiance.irradiance(octree, np.repeat(places, 64, 0), *contenders.EXACT_DIRECT)
    truth = [ours(shadow, jnp.asarray(p)) for p in places]
    np.testing.assert_allclose(found.reshape(-1, 64).mean(1), truth, rtol=0.02)


@pytest.mark.skipif(not measure.is_there("mitsuba"), reason="mitsuba is not installed")
def test_mitsuba_sees_what_we_see():
    from benchmarks.peers import mitsuba_renderer

    shadow = SHADOWS["overlapping"]
    scene = mitsuba_renderer.loaded(shadow.scene())
    found = [mitsuba_renderer.irradiance(scene, p, 4096, 0) for p in shadow.places]
    truth = [ours(shadow, jnp.asarray(p)) for p in shadow.places]
    np.testing.assert_allclose(found, truth, rtol=0.03)


# --- what is measured ----------------------------------------------------------------------------


def test_times_at_a_level_of_error():
    rows = [
        {"way": contenders.OURS, "seconds": 1.0, "error": 1e-11},
        {"way": "other", "seconds": 10.0, "error": 0.1},
        {"way": "other", "seconds": 1000.0, "error": 0.001},
        {"way": "lost", "seconds": 10.0, "error": 0.1},
    ]
    found = gradients.said(rows)
    assert found["other"]["error"] == 0.001
    assert found["other"]["times ours"] == 1000.0
    assert found["other"]["times ours at the level"] == pytest.approx(100.0)
    assert found["lost"]["times ours at the level"] is None
    whole = [{**row, "low": row["seconds"], "high": row["seconds"]} for row in rows]
    assert [row["high"] for row in gradients.over(whole)] == [1.0, 10.0, 1000.0, 10.0]


def test_pixels_are_row_by_row_from_the_top():
    seen = gradients.window(SHADOWS["box"])
    x = seen.centers()
    assert x.shape == (seen.rows * seen.columns, 2)
    assert x[0, 1] > x[-1, 1]
    assert x[1, 0] - x[0, 0] == pytest.approx(gradients.PIXEL)


def test_processor_time_counts_programs_that_were_run():
    import subprocess
    import sys

    command = [sys.executable, "-c", "sum(range(10**6))"]
    _, seconds = measure.timed(lambda: subprocess.run(command, check=True))
    assert seconds > 0.005


# --- every comparison runs -----------------------------------------------------------------------


def quick(name):
    return importlib.import_module(f"benchmarks.peers.{name}").run(True)


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_each_runs_alone_and_says_who_is_missing(name, alone, capsys):
    found = run(name, quick=True)
    assert found["left out"]
    said = capsys.readouterr().out
    for sentence in found["left out"]:
        assert sentence.endswith(".")
        assert sentence in said
    text = page.page({name: found})
    assert found["left out"][0] in text


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_each_runs_with_what_is_there(name):
    assert bool(quick(name)["left out"]) == (not all(map(measure.is_there, _asked(name))))


def _asked(name):
    return {
        "gradients": ("pyradiance", "mitsuba"),
        "floor_cache": ("pyradiance",),
        "one_bounce": ("pyradiance", "mitsuba"),
        "flatland_hits": ("numba",),
    }[name]


def test_what_is_kept_is_a_page_and_pictures():
    results = json.loads((page.FOLDER / RESULTS).read_text(encoding="utf-8"))
    assert "gradients" in results
    assert set(results) <= set(NAMES)
    assert not any(found["quick"] for found in results.values())
    for name in {"gradients", "floor_cache"} & set(results):
        assert (page.FOLDER / f"{name}.png").stat().st_size < 200_000


@pytest.mark.slow
def test_a_run_of_one_keeps_the_others(tmp_path, alone):
    keep(tmp_path, {"other": {"mark": 1}})
    found = json.loads((tmp_path / RESULTS).read_text(encoding="utf-8"))
    results = found | {"flatland_hits": run("flatland_hits", quick=True)}
    keep(tmp_path, results)
    assert set(json.loads((tmp_path / RESULTS).read_text(encoding="utf-8"))) == set(results)


def test_a_name_that_is_none_is_refused(capsys):
    with pytest.raises(SystemExit):
        main(["gradient"])
    assert "invalid choice" in capsys.readouterr().err
