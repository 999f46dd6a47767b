"""What notebooks show: nothing fails, and what is shown is the formula."""

import json
import subprocess
import sys

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import sympy

from firstorder.checks.registry import all_cases
from firstorder.conventions import FLATLAND, FLATLAND_SLOPE
from firstorder.fields import Field, GaussianProfile, Grid, Jet, SampledSpectrum, gaussian
from firstorder.laws import Law
from firstorder.symbolic import derive, event, formula
from firstorder.symbolic._display import latex, markdown
from firstorder.transport import Bump, Chain, Curvature, Event, Mirror, Reflection, Travel

LIGHT = gaussian((0.2, 0.1), (0.5, 0.3), frame=FLATLAND_SLOPE)
d = sympy.Symbol("d", positive=True)


@pytest.mark.parametrize("name", all_cases())
def test_every_law_event_and_path_of_the_registry_is_shown(name):
    case = all_cases()[name]
    shown = [case.step._repr_markdown_()]
    if not isinstance(case.step, Law):
        shown.append((case.field >> case.step)._repr_markdown_())
    for words in shown:
        heading, *said = words.split("\n\n")
        assert heading.startswith("**")
        assert 1 <= len(said) <= 2
        assert all(line.startswith(("$$", "value", "spectrum")) for line in said), said
        assert len(words) < 8000


@pytest.mark.parametrize("name", ["travel", "curvature", "mirror", "move", "texture"])
def test_the_formula_that_is_shown_is_that_of_the_derivation(name):
    step = all_cases()[name].step
    shown = step._repr_markdown_()
    frame = FLATLAND_SLOPE if "(x, v)" in shown else FLATLAND
    frame = frame.turned() if "outgoing" in shown else frame
    found = derive(step, frame)
    assert f" = {latex(found.value.expression)}$$" in shown
    assert f" = {latex(found.spectrum.expression)}$$" in shown


def test_a_law_says_what_it_does_and_why_it_has_no_spectrum():
    travel = Travel(d)._repr_markdown_()
    assert travel.startswith("**Travel** (D05 eqs. 2-3")
    assert "incoming light over $(x, v)$" in travel  # and not over angles, where it is a warp
    assert r"$$L'(x, v) = L\left(- d v + x, v\right)$$" in travel
    assert (
        r"$$\hat{L}'(\Omega_{x}, \Omega_{v}) = \hat{L}\left(\Omega_{x}, "
        r"\Omega_{v} + \Omega_{x} d\right)$$"
    ) in travel
    bump = Bump(lambda x: 0.1 * x**2)._repr_markdown_()
    assert r"L\left(x, \theta + \frac{x^{2}}{10}\right)" in bump
    assert "spectrum refused: warp has no simple Fourier formula" in bump


def test_a_matrix_is_shown_on_light_of_as_many_coordinates():
    shown = all_cases()["move in space, 24^4"].step._repr_markdown_()
    assert "incoming light over $(x, y, v, w)$" in shown


def test_an_event_of_ones_own_goes_by_its_name():
    x, theta, f = sympy.symbols("x theta f")
    lens = event({theta: theta - x / f}, parameters={f: f}, name="thin lens")
    assert lens._repr_markdown_().startswith("**thin lens**, incoming light over")
    assert r"\theta + \frac{x}{f}" in lens._repr_markdown_()


def test_a_path_shows_its_events_and_where_they_lead():
    shown = (LIGHT >> Travel(2.0))._repr_markdown_()
    assert shown.startswith("**Gaussian → Travel**")
    assert f"= {latex(derive(LIGHT >> Travel(2.0)).value.expression)}$$" in shown
    chain = Curvature(0.4) >> Mirror() >> Reflection(GaussianProfile(0.2))
    assert chain._repr_markdown_().startswith("**Curvature → Mirror → Reflection**, incoming")


def test_a_derivation_shows_its_steps_and_where_they_lead():
    far = derive(Travel(d), FLATLAND_SLOPE)
    assert repr(far).startswith("Derivation of L >> Travel: value, ")
    shown = far._repr_markdown_()
    assert shown.startswith("**L → Travel**")
    assert r"$$L'(x, v) = L\left(- d v + x, v\right)$$" in shown
    assert (LIGHT >> Travel(2.0))._repr_markdown_() == derive(
        LIGHT >> Travel(2.0)
    )._repr_markdown_()


def test_what_takes_no_known_light_says_so():
    shown = (Mirror() >> Mirror())._repr_markdown_()
    assert "It takes no light that is known here: Mirror needs incoming light" in shown


def test_a_jet_is_shown_as_matrices_with_its_coordinates():
    jet = Jet(
        jnp.asarray(1.0), jnp.array([2.0e-9, -0.5]), jnp.array([[1.0, 0.25], [0.25, 1e6]]), FLATLAND
    )
    shown = jet._repr_markdown_()
    assert shown.startswith(r"**Jet** of incoming light over $(x, \theta)$")
    assert "$$L = 1$$" in shown
    assert r"\begin{pmatrix} 2 \cdot 10^{-9} \\ -0.5 \end{pmatrix}$$" in shown
    assert r"\partial_{x} \partial_{\theta} L" in shown
    assert r"\begin{pmatrix} 1 & 0.25 \\ 0.25 & 1 \cdot 10^{6} \end{pmatrix}$$" in shown
    many = LIGHT.jets(np.zeros((2, 3)), 0.0)
    assert many._repr_markdown_().endswith("over $(x, v)$, at 2 x 3 rays")
    traced = []
    jax.jit(lambda u: traced.append(LIGHT.jet(u)._repr_markdown_()))(jnp.zeros(2))
    assert r"L = \text{traced}" in traced[0]
    assert r"\Sigma = \begin{pmatrix}" in LIGHT.covariance()._repr_markdown_()


def test_a_spectrum_is_shown_by_its_formula():
    shown = LIGHT.spectrum()._repr_markdown_()
    assert shown.startswith("**GaussianSpectrum** of incoming light over $(x, v)$")
    assert r"\hat{L}(\Omega_{x}, \Omega_{v}) = " in shown
    table = SampledSpectrum.of(LIGHT, Grid((65, 65), (0.1, 0.1)))
    assert "a transform of 4225 numbers, and no formula" in table._repr_markdown_()
    light = gaussian((0.0, 0.0), (1.0, 1.0), frame=FLATLAND.turned())
    blurred = Reflection(GaussianProfile(0.2))(light.spectrum())
    assert r"\Omega_{\theta}^{2}" in blurred._repr_markdown_()
    found = derive(Travel(d), FLATLAND_SLOPE).spectrum
    assert (
        found._repr_markdown_() == r"$$\hat{L}\left(\Omega_{x}, \Omega_{v} + \Omega_{x} d\right)$$"
    )


def test_floats_have_six_digits_and_whole_numbers_none():
    y = sympy.Symbol("y")
    assert latex(sympy.Float(1.0) * y + sympy.Float(1 / 3)) == "y + 0.333333"
    assert latex(formula(LIGHT).expression) == sympy.latex(formula(LIGHT).expression)


def test_what_nobody_knows_how_to_show_is_refused():
    with pytest.raises(TypeError, match="how to show a int"):
        markdown(3)


FRESH = """
import json, sys
from firstorder.conventions import FLATLAND_SLOPE
from firstorder.fields import gaussian
from firstorder.transport import Travel
path = gaussian((0.0, 0.0), (1.0, 1.0), frame=FLATLAND_SLOPE) >> Travel(2.0)
before = "sympy" in sys.modules
print(json.dumps([before, path.events[0]._repr_markdown_(), repr(path.events[0])]))
"""


def test_it_works_without_the_symbols_and_leaves_the_plain_repr_alone():
    done = subprocess.run([sys.executable, "-c", FRESH], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    before, shown, plain = json.loads(done.stdout)
    assert not before, "sympy is loaded before anybody asks"
    assert r"$$L'(x, v) = L\left(- 2 v + x, v\right)$$" in shown
    assert plain.startswith("Travel(")
    for kind in (Law, Event, Chain, Jet):
        assert kind.__repr__ is Field.__repr__
