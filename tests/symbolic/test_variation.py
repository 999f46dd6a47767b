import numpy as np
import pytest
import sympy

from firstorder.conventions import SPACE_SLOPE
from firstorder.errors import Refused
from firstorder.fields import GaussianProfile, gaussian
from firstorder.symbolic import (
    NamedTerms,
    UnknownField,
    UnknownLobe,
    UnknownVaryingLobe,
    derive,
    named_terms,
)
from firstorder.transport import (
    Bump,
    Curvature,
    Mirror,
    Reflection,
    Snell,
    Surface,
    Texture,
    Travel,
    glossy,
    wave,
)

LIGHT = gaussian((0.2, 0.1), (0.5, 0.3), 0.3)
N, RHO = UnknownField("n", ("x",)), UnknownLobe("rho")


def shiny(normal, lobe):
    return Bump(normal) >> Mirror() >> Reflection(lobe) >> Bump(normal, back=True)


def test_the_terms_add_up_to_the_derivative():
    spotted = shiny(N, UnknownVaryingLobe("rho")) >> Texture(UnknownField("T", ("x",)))
    found, true = named_terms(spotted), derive(spotted)
    numbers = {"L": LIGHT, "T": wave(0.3, 0.2, mean=0.7), "n": wave(0.2, 0.1)}
    numbers["rho"] = gaussian((0.0, 0.0), (1.0, 0.2))
    at = np.array([0.3, -0.2]), np.array([0.1, 0.4])
    gradient = true.gradient.lower(**numbers)(*at)
    parts = [t.lower(**numbers)(*at) for t in (found.SV, found.CDV, found.MV)]
    np.testing.assert_allclose(sum(parts), gradient[:, 0], rtol=1e-11)
    np.testing.assert_allclose(found.total.lower(**numbers)(*at), gradient[:, 0], rtol=1e-11)
    assert np.all(np.abs(np.stack(parts)) > 1e-3 * np.abs(gradient[:, 0]))


def test_their_numbers_are_those_of_a_surface():
    normal = wave(0.2, 0.1)
    found = named_terms(LIGHT >> shiny(normal, GaussianProfile(0.2)))
    (true,) = Surface(normal, glossy(0.2)).reflect(LIGHT).terms(0.3, 0.1)
    for name in ("SV", "DV", "CV", "CDV"):
        term = getattr(found, name)
        value = term.lower(L=LIGHT)(0.3, 0.1) if name != "CV" else term.at(0.3, 0.1)
        np.testing.assert_allclose(value, getattr(true, name), rtol=1e-9)


def test_a_direction_that_turns_unlike_has_no_curvature():
    """Glass turns rays by how steep they are; a lobe before it adds up many of them."""
    steps = Mirror() >> Reflection(RHO) >> Curvature(0.3, back=True) >> Snell(1.5)
    assert not isinstance(named_terms(steps).CV, Refused)
    steps = Snell(1.5) >> Mirror() >> Reflection(RHO) >> Curvature(0.3, back=True)
    found = named_terms(steps)
    assert isinstance(found.CV, Refused)
    assert "CV = refused: the direction does not turn alike" in str(found)


def test_it_prints_itself():
    found = named_terms(shiny(N, RHO))
    assert isinstance(found, NamedTerms)
    assert "\nCV = 2*n_x(x)\n" in str(found)
    table = found._repr_markdown_().splitlines()
    assert len(table) == 2 + 5
    clamped = named_terms(Texture(UnknownField("T", ("x",))) >> Texture(lambda x: abs(x)))
    assert all(row.count("|") == 4 for row in clamped._repr_markdown_().splitlines())


def test_light_of_space_is_refused():
    with pytest.raises(Refused, match="one position and one direction"):
        named_terms(Travel(sympy.Symbol("d", positive=True)), SPACE_SLOPE)
