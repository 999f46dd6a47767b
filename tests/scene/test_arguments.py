"""What the public calls of both worlds refuse by their arguments alone, in one sentence."""

import pytest

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
