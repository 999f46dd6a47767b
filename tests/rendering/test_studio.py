"""The light rig: what a white surface shows in it, and that its lamps face the middle."""

import equinox as eqx
import numpy as np
import pytest

from firstorder.imaging import pinhole
from firstorder.io.images import LUMINANCE
from firstorder.rendering import Renderer, World, light_rig
from firstorder.space import Scene, primitive, rectangle

MIDDLE = np.array([0.3, 0.2, 0.5])


def shown(number: int) -> np.ndarray:
    """Radiance at the middle of a small white card that faces a lamp, in its light alone."""
    lamp = light_rig(MIDDLE, 1.0, (1.0, -2.0, 3.0), nodes=4, softness=0.1).lamps[number]
    n = (np.asarray(lamp.center) - MIDDLE) / np.linalg.norm(np.asarray(lamp.center) - MIDDLE)
    u = np.cross(n, (0.0, 0.0, 1.0))
    u *= 0.01 / np.linalg.norm(u)
    card = primitive(rectangle(MIDDLE, u, np.cross(n, u)), albedo=1.0)
    eye = MIDDLE + 2.0 * n + 0.5 * u / 0.01
    world = World(pinhole(eye, MIDDLE), Scene.of(card), (), (lamp,))
    found, index = Renderer(world).pixels(np.zeros((1, 2)))
    assert index.tolist() == [0]
    return np.asarray(found.value)[0]


def check_key_and_rim_give_what_is_said():
    for number, said in ((0, 1.0), (1, 0.5)):
        # To first order in the softness: (1 + h^2)^-2 and smaller.
        assert shown(number) @ LUMINANCE == pytest.approx(said, rel=0.03)


def test_key_and_rim():
    check_key_and_rim_give_what_is_said()


@pytest.mark.parametrize("fault", ["area of a half", "turned away"])
def test_a_fault_is_seen(fault, monkeypatch):
    right = light_rig

    def wrong(*args, **options):
        rig = right(*args, **options)
        bad = [
            eqx.tree_at(lambda a: a.radiance, lamp, 0.25 * lamp.radiance)
            if fault == "area of a half"
            else eqx.tree_at(lambda a: a.u, lamp, -lamp.u)
            for lamp in rig.lamps
        ]
        return rig._replace(lamps=tuple(bad))

    monkeypatch.setitem(globals(), "light_rig", wrong)
    with pytest.raises(AssertionError):
        check_key_and_rim_give_what_is_said()


def test_the_key_is_left_of_the_eye_and_the_rim_behind():
    key, rim = light_rig((0, 0, 0), 1.0, (0, -1, 0)).lamps
    assert key.center[0] < 0.0
    assert key.center[1] < 0.0 < rim.center[1]
    assert light_rig((0, 0, 0), 1.0, (0, -1, 0), rim=0.0).lamps[1:] == ()
    with pytest.raises(ValueError, match="vertical"):
        light_rig((0, 0, 0), 1.0, (0, 0, 1))


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"center": (0, 0)}, r"`center` must have three coordinates"),
        ({"toward_eye": (0, -1)}, r"`toward_eye` must have three coordinates"),
        ({"toward_eye": (np.nan, -1, 0)}, r"`toward_eye` must be finite"),
        ({"fill": -1.0}, r"`fill` must not be negative"),
        ({"rim": -1.0}, r"`rim` must not be negative"),
    ],
)
def test_what_is_no_rig_is_one_sentence(given, sentence):
    with pytest.raises(ValueError, match=sentence):
        light_rig(**({"center": (0, 0, 0), "size": 1.0, "toward_eye": (0, -1, 0)} | given))
