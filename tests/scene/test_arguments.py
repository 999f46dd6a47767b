"""What the public calls of both worlds refuse by their arguments alone, in one sentence."""

import pytest

from firstorder import flatland, space
from firstorder.scene import _arguments as arguments


def test_a_name_that_is_gone_is_answered_with_the_new_one():
    arguments.check_names({}, {"sky": "environment"})
    with pytest.raises(TypeError) as found:
        arguments.check_names({"sky": 1.0}, {"sky": "environment"})
    assert str(found.value) == "Argument `sky` is called `environment`."
    with pytest.raises(TypeError) as found:
        arguments.check_names({"lamp": 1.0}, {"sky": "environment"})
    assert str(found.value) == "Argument `lamp` does not exist."


def test_a_thing_that_is_no_primitive_is_told_by_its_place():
    with pytest.raises(TypeError, match="Argument 2 must be"):
        arguments.check_primitives(["one", 2.0], str, int)


@pytest.mark.parametrize("world", [(flatland, space), (space, flatland)], ids=["flat", "space"])
def test_a_sky_of_the_other_world_is_refused(world):
    """That of space would be called with an angle, and take it for a direction."""
    here, there = world
    with pytest.raises(TypeError, match=r"^Argument `environment` must be of .*, but is a Gaus"):
        arguments.check_sky(there.GaussianSky(), here.Scene)
    arguments.check_sky(here.GaussianSky(), here.Scene)
