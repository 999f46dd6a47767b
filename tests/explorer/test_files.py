"""A board is saved and loaded without loss, and the Python that is copied makes the same scene."""

import dataclasses

import jax
import numpy as np
import pytest
from flatland_explorer import files
from flatland_explorer.board import Board, Part, first_board, sorted_board

from firstorder.flatland import ConstantSky, GaussianSky, PanoramaSky
from firstorder.io import flatland_to_toml

EGG = Part("ellipse", {"center": (-0.9, 0.9), "semi": (0.2, 0.1), "tilt": 0.4}, "egg <&>")
POINT = Part("point", {"position": (-1.2, 1.4), "intensity": 2.0})
GLASS = Part(
    "circle", {"center": (0.9, 0.4), "radius": 0.1}, "glass", {"ior": 1.5, "albedo": (0.25, 0.5)}
)
CURVE = Part(
    "curve",
    {"cosines": ((0.6, 1.0), (0.0, 0.2)), "sines": ((0.0, 0.0), (0.25, 0.0)), "samples": 32},
)


def board(*more):
    first = first_board()
    changed = dataclasses.replace(first, probe=0.3, tilt=-0.2, tolerance=0.003)
    return sorted_board(changed, [*first.parts, *more], first.parts[first.receiver])


SKIES = [None, ConstantSky(0.3), GaussianSky(0.2, 0.4, 1.5)]


@pytest.mark.parametrize("sky", [*SKIES, PanoramaSky(np.arange(8.0))])
def test_toml_brings_a_board_back_to_the_bit(sky):
    before = dataclasses.replace(board(EGG, GLASS, CURVE, POINT), environment=sky)
    after = files.read("a.toml", files.to_toml(before))
    assert dataclasses.replace(after, environment=None) == dataclasses.replace(
        before, environment=None
    )
    assert flatland_to_toml(after.scene()) == flatland_to_toml(before.scene())


@pytest.mark.parametrize("sky", SKIES)
def test_a_drawing_brings_a_board_back_to_rounding(sky):
    before = dataclasses.replace(board(EGG, GLASS, POINT), environment=sky)
    after = files.read("a.svg", files.to_svg(before))
    assert (after.receiver, after.probe, after.tilt) == (before.receiver, 0.3, -0.2)
    for a, b in zip(after.parts, before.parts, strict=True):
        assert (a.kind, a.name, a.material) == (b.kind, b.name, b.material)
        if a.kind == "ellipse":  # turned by half a turn it is the same
            np.testing.assert_allclose(a.numbers["semi"], b.numbers["semi"])
            assert np.sin(a.numbers["tilt"] - b.numbers["tilt"]) == pytest.approx(0.0)
            np.testing.assert_allclose(a.middle, b.middle)
        else:
            np.testing.assert_allclose(a.outline(), b.outline(), rtol=0.0, atol=1e-9)
    old, new = (jax.tree.leaves(b.environment) for b in (before, after))
    assert old == new


def test_an_arc_of_more_than_half_a_circle_keeps_its_side_in_a_drawing():
    for sweep in (4.0, -4.0, 2.0, -2.0):
        arc = Part("arc", {"center": (0.0, 0.5), "radius": 0.3, "start": 1.0, "sweep": sweep})
        after = files.read("a.svg", files.to_svg(board(arc)))
        found = next(part for part in after.parts if part.kind == "arc" and not part.name)
        np.testing.assert_allclose(found.outline(), arc.outline(), rtol=0.0, atol=1e-9)


def run(text):
    found = {}
    exec(text.replace("session.start()\n", ""), found)  # the tests' flags stay
    return found


def test_copied_python_makes_an_equal_scene():
    before = dataclasses.replace(board(EGG, GLASS, CURVE, POINT), environment=ConstantSky(0.3))
    text, asks = files.to_python(before).split("light =")
    assert flatland_to_toml(run(text)["scene"]) == flatland_to_toml(before.scene())
    assert asks


def test_copied_python_runs_and_says_what_falls_on_the_probe(capsys):
    text = files.to_python(Board(first_board().parts[:2], probe=0.25))
    E = run(text)["light"].value
    a, b = (x / np.hypot(x, 1.3) for x in (0.8, -0.2))  # sines of the lamp's ends
    assert float(E) == pytest.approx(a - b)
    assert len(capsys.readouterr().out.split()) == 3


def test_what_a_drawing_has_no_words_for_is_refused():
    for wrong in (
        board(CURVE),
        dataclasses.replace(board(), environment=PanoramaSky(np.ones(4))),
    ):
        with pytest.raises(ValueError, match=r"save TOML\.$"):
            files.to_svg(wrong)


def test_what_is_no_file_of_a_scene_is_said_in_a_sentence():
    for name, text in (
        ("a.png", ""),
        ("a.toml", "[[shape]]\nkind = 'x'"),
        ("a.svg", "<svg"),
        ("../../a.toml", "nonsense"),
    ):
        with pytest.raises(ValueError, match=r"^a\..*\.$"):
            files.read(name, text)


def test_a_comment_of_another_hand_does_no_harm():
    text = files.to_toml(first_board())
    head, rest = text.split("\n", 1)
    assert isinstance(files.read("a.toml", "# explorer: {nonsense}\n" + rest), Board)
    far = head.replace('"receiver": 0', '"receiver": 99')
    assert files.read("a.toml", far + "\n" + rest).receiver == 0
