"""What the README and the documentation show runs, and leads somewhere."""

import pathlib
import re

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
import pytest
import sympy

from firstorder.cli import main
from firstorder.io import flatland_from_toml, read_layers

ROOT = pathlib.Path(__file__).parents[1]
README = ROOT / "README.md"
DOCS = ROOT / "docs"
PAGES = [README, *sorted(DOCS.glob("*.md")), *sorted(DOCS.glob("tasks/*.md"))]


def examples(page):
    return re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)


def ran(example):
    """The names that an example leaves."""
    names = {}
    exec(compile(example, "example", "exec"), names)
    return names


def test_the_readme_is_short():
    assert len(README.read_text(encoding="utf-8").splitlines()) <= 150


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links_and_pictures_lead_to_files(page):
    """Those to generated pages: `tests/test_docs.py`."""
    text = page.read_text(encoding="utf-8")
    targets = [
        t for t in re.findall(r"\]\(([^)#]+)", text) if "://" not in t and "_generated" not in t
    ]
    assert [t for t in targets if not (page.parent / t).exists()] == []


@pytest.mark.smoke
def test_the_path_of_the_portraits_is_short_and_equals_its_closed_form(capsys):
    reflection = examples(DOCS / "portraits.md")[0]
    assert len(reflection.splitlines()) <= 12
    ran(reflection)
    lines = [line for line in capsys.readouterr().out.splitlines() if not line.isalpha()]
    ours, closed = (
        np.concatenate([np.ravel(eval(line)) for line in part])
        for part in (lines[0::2], lines[1::2])
    )
    assert ours.shape == (7,)
    np.testing.assert_allclose(ours, closed, rtol=1e-12)


@pytest.fixture
def shadow(tmp_path, monkeypatch, capsys):
    """What the README's example leaves, its picture and what it prints."""
    monkeypatch.chdir(tmp_path)
    plt.close("all")
    names = ran(examples(README)[0])
    plt.close("all")
    return names, (tmp_path / "shadow.png").read_bytes(), capsys.readouterr().out


@pytest.mark.smoke
def test_the_shadow_of_the_example_is_that_of_a_disc(shadow):
    names, picture, said = shadow
    assert picture[:4] == b"\x89PNG"

    def closed(x, radius):
        """The lamp's two parts beside the disc, towards +x."""
        sine = lambda px, py: (px - x) / np.hypot(px - x, py)  # noqa: E731
        middle = np.arctan2(0.1 - x, 0.5)
        half = np.arcsin(radius / np.hypot(0.1 - x, 0.5))
        low, high = sine(-0.5, 1.0), sine(0.5, 1.0)
        return (high - low) - (np.sin(middle + half) - np.sin(middle - half))

    h, r = 1e-5, 0.1
    # Places that see both parts of the lamp.
    k = np.flatnonzero((names["x"] > -0.05) & (names["x"] < 0.4))
    x = names["x"][k]
    np.testing.assert_allclose(names["value"][k], closed(x, r), rtol=1e-12)

    def closed_slopes(x):
        """By place and by radius, as differences."""
        by_place = closed(x + h, r) - closed(x - h, r)
        return np.array([by_place, closed(x, r + h) - closed(x, r - h)]) / (2.0 * h)

    by_place, by_radius = closed_slopes(x)
    np.testing.assert_allclose(names["by_place"][k], by_place, rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(names["by_radius"][k], by_radius, rtol=0.0, atol=1e-8)
    bend = jax.hessian(names["E"])(0.3, r)
    far = 1e-4
    twice = (closed(0.3 + far, r) - 2.0 * closed(0.3, r) + closed(0.3 - far, r)) / far**2
    np.testing.assert_allclose(bend, twice, rtol=0.0, atol=2e-6)
    less, takes = -0.01 * closed_slopes(0.1)
    numbers = [float(n) for n in re.findall(r"[\d.]+(?= W/m)", said)]
    rounded = [round(closed(0.1, r), 3), round(less, 4), round(takes, 4)]
    np.testing.assert_allclose(numbers, rounded, rtol=1e-12)


def test_a_scene_comes_back_from_its_file():
    names = ran(examples(DOCS / "scenes.md")[0])
    again, scene = flatland_from_toml(names["text"]), names["scene"]
    assert jax.tree.structure(again) == jax.tree.structure(scene)
    jax.tree.map(np.testing.assert_array_equal, again, scene)


def test_the_gradient_of_the_page_of_space_is_that_of_differences():
    names = ran(examples(DOCS / "space.md")[0])
    world, scene, receiver, d = (names[n] for n in ("world", "scene", "receiver", "d"))
    h = 1e-4
    ahead, back = (
        world.irradiance(scene, receiver.displaced(jnp.zeros(5).at[0].set(x))) for x in (h, -h)
    )
    np.testing.assert_allclose(d.gradient[0], (ahead - back) / (2.0 * h), rtol=1e-6)


def test_the_events_of_the_page_of_space_are_those_of_one_sided_differences():
    """Those at one place add up."""
    names = ran("\n".join(examples(DOCS / "space.md")[:2]))
    world, scene, events, start = (names[n] for n in ("world", "scene", "events", "start"))
    way, h = jnp.array([1.0, 0.1, 0.0]) / jnp.sqrt(1.01), 1e-3
    assert len(names["mesh"]) > 5

    def E(x):
        return world.irradiance(scene, world.Receiver.at(start.position + x * way))

    for x in np.unique(events.x[events.order == 1].round(9)):
        jump = np.sum(events.jump_E1[np.abs(events.x - x) < 1e-6])
        before, at, after = (float(E(x + s * h)) for s in (-1.0, 0.0, 1.0))
        further = float(E(x - 2.0 * h)), float(E(x + 2.0 * h))
        slopes = 3.0 * at - 4.0 * before + further[0], -3.0 * at + 4.0 * after - further[1]
        np.testing.assert_allclose((slopes[1] - slopes[0]) / (2.0 * h), jump, rtol=0.0, atol=1e-4)


def test_the_page_of_pictures_shows_what_its_example_draws_and_prints(
    tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    plt.close("all")
    names = ran(examples(DOCS / "pictures.md")[0])
    plt.close("all")
    printed = capsys.readouterr().out
    assert f"```\n{printed}```" in (DOCS / "pictures.md").read_text(encoding="utf-8")
    drawn, shown = (plt.imread(p / "pictures.png") for p in (tmp_path, DOCS / "_static"))
    assert drawn.shape[:2] == shown.shape[:2]
    lines = {line.get_color() for line in names["axes"][0, 0].lines}
    assert "#e0a526" in lines, "the lamp"


def test_the_page_of_pictures_draws_a_path_as_a_strip(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = ran(examples(DOCS / "pictures.md")[1])
    plt.close("all")
    assert plt.imread("strip.png").ndim == 3
    past = names["path"].steps[2]
    assert past(0.0, 0.0) == 0.0  # behind the edge at 0.1 m
    assert past(0.2, 0.0) > 0.0


def test_the_page_of_pictures_renders_a_still(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    image = ran(examples(DOCS / "pictures.md")[2])["image"]
    assert plt.imread("ball.png").shape[:2] == (18, 32)
    assert 0.0 < np.max(image.error) < 0.5 * np.max(image.value)


def test_the_equations_of_a_travel_are_those_of_a_shear(capsys):
    far = ran(examples(DOCS / "symbolic.md")[0])["far"]
    x, v, d = sympy.symbols("x v d")
    shown = str(far.value.expression)
    assert shown == str(sympy.Function("L")(x - d * v, v))
    assert shown in capsys.readouterr().out


def test_the_table_and_the_data_set_of_the_page_of_other_tools_are_of_one_curve():
    names = ran(examples(DOCS / "other_tools.md")[0])
    table, d = names["table"], names["d"]
    np.testing.assert_allclose(d.value, table.E, rtol=1e-12)
    np.testing.assert_allclose(d.gradient.sel(freedom="x"), table.dE, rtol=1e-9, atol=1e-12)
    assert names["turned"].shape == (21,)
    assert table.E.max() == names["brightest"].E


def test_the_lamp_of_mitsuba_is_ours():
    names = ran(examples(DOCS / "other_tools.md")[1])
    np.testing.assert_allclose(names["E"], 3.0 * np.pi / 16.0, rtol=1e-12)
    assert names["written"]["lamp"]["center"] == names["lamp"]["center"]


def test_every_page_with_an_example_is_among_those_tested():
    """Those of the tasks: `tests/test_tasks.py`."""
    assert {p.name for p in PAGES if examples(p) and p.parent.name != "tasks"} == {
        "README.md", "colour.md", "many_machines.md", "other_tools.md", "pictures.md",
        "portraits.md", "scenes.md", "space.md", "symbolic.md",
    }  # fmt: skip


def test_the_page_of_many_machines_sweeps_a_table():
    names = ran(examples(DOCS / "many_machines.md")[0])
    assert list(names["found"]) == ["radius", "x", "E"]
    assert np.all(names["found"]["E"] > 0.0)


def test_the_page_of_colour_prints_what_it_shows(capsys):
    page = DOCS / "colour.md"
    names = ran(examples(page)[0])
    shown = re.search(r"prints\n\n```\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)
    assert shown
    assert capsys.readouterr().out == shown[1]
    direct = names["direct"]
    np.testing.assert_allclose(direct / direct[1], [1.2, 1.0, 0.8], rtol=1e-12)


def test_light_that_a_red_wall_sends_on_is_red(tmp_path, monkeypatch):
    (tmp_path / "examples").mkdir()
    example = ROOT / "examples" / "colour.toml"
    (tmp_path / "examples" / "colour.toml").write_text(example.read_text())
    monkeypatch.chdir(tmp_path)
    image = ran(examples(DOCS / "colour.md")[1])["image"]
    assert image.shape == (8, 8, 3)
    assert (tmp_path / "bounced.png").stat().st_size > 0
    r, g, _ = np.asarray(image)[np.asarray(image)[..., 1] > 0.0].T
    assert np.min(r / g) < 1.3  # the floor far away is nearly as red as the lamp, 1.2
    assert np.max(r / g) > 9.0  # the wall


def test_the_command_of_the_page_of_colour_renders_red_green_and_blue(tmp_path):
    pytest.importorskip("OpenEXR")
    text = (DOCS / "colour.md").read_text(encoding="utf-8")
    shown = re.search(r"^firstorder (render examples/colour\.toml) --out (\w+\.exr)$", text, re.M)
    assert shown
    command, file = shown[1].split(), tmp_path / shown[2]
    command[1] = str(ROOT / command[1])
    size = ["--width", "8", "--height", "8", "--nodes", "2", "--out", str(file)]
    assert main([*command, *size]) == 0
    layers = read_layers(file)
    value = np.stack([layers[band] for band in "RGB"], -1)
    wall, floor, ball = (value[layers["index"] == k].mean(0) for k in (2, 1, 0))
    assert wall[0] > 9.0 * wall[1] > 0.0
    assert ball[1] > 2.0 * ball[0] > 0.0
    np.testing.assert_allclose(floor / floor[1], [1.2, 1.0, 0.8], rtol=1e-6)
