import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.conventions import Frame
from firstorder.errors import Refused
from firstorder.fields import GaussianProfile, gaussian
from firstorder.symbolic import UnknownField, UnknownLobe, UnknownVaryingLobe, explain
from firstorder.transport import Bump, Camera, Chain, Curvature, Mirror, Reflection, Texture, Travel

LIGHT = gaussian((0.2, 0.1), (0.5, 0.3))
LOBE = Reflection(GaussianProfile(0.2))
SHINY = LIGHT >> Curvature(0.4) >> Mirror() >> LOBE >> Curvature(0.4, back=True)


def test_each_step_has_its_event_its_source_its_formula_and_its_numbers():
    told = explain(SHINY, (0.3, -0.1))
    names = ["source", "Curvature", "Mirror", "Reflection", "Curvature"]
    assert [s.name for s in told.steps] == names
    assert told.steps[2].reference == "R07 eqs. 12-13; D05 eq. 14."
    assert str(told.steps[2].formula) == "L(x, -theta)"
    for step, field in zip(told.steps, SHINY.steps, strict=True):
        assert step.jet is not None
        np.testing.assert_allclose(step.jet.value, field.at(step.ray), rtol=1e-12)
    np.testing.assert_allclose(told.steps[1].ray, [0.3, 0.22], rtol=1e-12)  # flipped, and turned
    assert "at x = 0.3, theta = -0.1: value" in str(told)
    assert "$$L\\left(x, - \\theta\\right)$$" in told._repr_markdown_()


def test_a_step_says_what_the_papers_call_it():
    told = explain(SHINY)
    assert [s.called for s in told.steps[:3]] == [
        "",
        "per-point rotation (R07 step 1, D05 step 2), and back (R07 step 4, D05 step 6)",
        "mirror reparameterization (R07 step 2, D05 step 4)",
    ]
    text = str(told)
    assert "\n2. Mirror, called mirror reparameterization (R07 step 2, D05 step 4)\n   [R07" in text
    assert "**2. Mirror**, called mirror reparameterization" in told.markdown
    assert told.steps[0].title == "source"


def test_a_camera_is_told():
    light = gaussian((0.0, 0.0), (1.0, 0.5), frame=LIGHT.frame.turned())
    told = explain(light >> Camera((0.0, 2.0), gamma=1.0), (0.5,))
    step = told.steps[1]
    assert step.title == "Camera, called perspective projection, of image gradients (R07 §5.3)"
    assert str(step.formula) == "L(2*px, atan(px))"
    np.testing.assert_allclose(told.steps[0].ray, [1.0, np.arctan(0.5)], rtol=1e-12)
    assert step.jet is not None
    assert told.steps[0].jet is not None
    B_x, B_theta = told.steps[0].jet.gradient
    np.testing.assert_allclose(step.jet.gradient[0], 2.0 * B_x + B_theta / 1.25, rtol=1e-12)
    assert "at px = 0.5: value" in str(told)


def test_unknown_light_has_formulas_and_no_numbers():
    n = UnknownField("n", ("x",))
    told = explain(Bump(n) >> Mirror() >> Reflection(UnknownLobe("rho")), (0.3, -0.1))
    assert all(step.jet is None for step in told.steps)
    assert "L(x, theta + n(x))" in str(told)
    assert "value" not in str(told)


def test_a_step_without_a_formula_says_why():
    """A table is made of numbers."""
    told = explain(LIGHT >> tabulate_like())
    assert isinstance(told.steps[1].formula, Refused)
    assert "refused: a program with the operation 'sort' has no formula" in str(told)
    assert "refused: a program" in told.markdown


def tabulate_like():
    """An event whose factor sorts."""
    return Texture(lambda x: jnp.sort(jnp.stack([x, 0.5 * x]))[0])


def test_a_chain_is_told_in_the_first_frame_that_it_takes():
    assert str(explain(Chain((LOBE,))).steps[0].formula) == "L(x, theta)"
    assert explain(Chain((LOBE,))).steps[0].formula.frame.sense == "outgoing"
    with pytest.raises(ValueError, match="Mirror needs incoming light"):
        explain(Mirror() >> Mirror())


def test_what_is_no_path_is_refused():
    with pytest.raises(TypeError, match="must be a path or a chain, but is Gaussian"):
        explain(LIGHT)


def test_a_path_with_an_unknown_varying_lobe_has_no_numbers():
    light = gaussian((0.0, 0.0), (1.0, 1.0), frame=Frame(sense="outgoing"))
    told = explain(light >> Reflection(UnknownVaryingLobe("rho")), (0.1, 0.2))
    assert [step.jet for step in told.steps] == [None, None]


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_a_ray_that_is_nowhere_is_refused(wrong):
    path = gaussian((0.0, 0.0), (1.0, 1.0)) >> Travel(1.0)
    with pytest.raises(ValueError, match="Argument `ray` must be finite"):
        explain(path, (wrong, 0.0))
