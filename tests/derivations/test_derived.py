"""What the library derives is what the papers say, and would not be anything else."""

import pathlib

import jax.numpy as jnp
import pytest
import sympy

from derivations.catalogue import load
from derivations.derived import frequency, irradiance
from derivations.derived.compare import flat, normal
from derivations.derived.listing import equations, listed
from firstorder.conventions import fourier_kernel
from firstorder.laws import Move
from firstorder.ledger import vanishes
from firstorder.scene._geometry_term import geometry_gradient
from firstorder.symbolic import _spectra, derive
from firstorder.transport import Curvature, Mirror, Travel

ROOT = pathlib.Path(__file__).parents[2]
EQUATIONS = equations()


def opaque(expression):
    """Integrals that differ are not simplified for minutes."""
    expression = sympy.sympify(expression)
    return expression.xreplace({e: sympy.Dummy() for e in expression.atoms(sympy.Integral)})


@pytest.mark.parametrize("name", EQUATIONS)
def test_what_is_derived_is_what_is_printed_and_nothing_near_it(name):
    derived, printed = (flat(side()) for side in (EQUATIONS[name].derived, EQUATIONS[name].printed))
    assert any(part != 0 for part in printed)
    for found, part in zip(map(normal, derived), printed, strict=True):
        assert vanishes(found - normal(part))
        for wrong in (sympy.Rational(1001, 1000) * part, -part) if part != 0 else ():
            assert not vanishes(opaque(found - normal(wrong)))


def test_an_equation_is_a_proof_of_the_ledger():
    """It returns what vanishes."""
    assert EQUATIONS["R07.25"]() == [0, 0]


def test_every_derived_equation_is_one_of_the_catalogue():
    assert set(EQUATIONS) <= set(load())


def test_a_hundred_numbered_equations_are_derived():
    assert sum(load()[name].numbered for name in EQUATIONS) >= 100


@pytest.mark.parametrize("text", ["docs/symbolic.md", "derive"])
def test_the_list_in_words_is_true(text):
    said = derive.__doc__ or "" if text == "derive" else (ROOT / text).read_text(encoding="utf-8")
    assert listed() in " ".join(said.split())


def twice_the_phase(Omega, u):
    return fourier_kernel(2.0 * Omega, u)


def a_little_more(*args):
    return 1.001 * geometry_gradient(*args)


FAULTS = {
    # whose part is replaced by what, and the equation that notices
    "a mirror that does nothing": (
        (Mirror, "law", lambda self, frame: Move(jnp.eye(2), to=frame.turned())), "R07.13"
    ),
    "a travel that arrives at once": (
        (Travel, "law", lambda self, frame: Move(jnp.eye(2))), "D05.2"
    ),
    "curvature along the wrong axis": (
        (Curvature, "law", lambda self, frame: Move(jnp.eye(2).at[0, 1].set(self.kappa))),
        "D05.11",
    ),
    "a phase twice too fast": ((_spectra, "fourier_kernel", twice_the_phase), "D05.9"),
    "a gradient off by a thousandth": (
        (irradiance, "geometry_gradient", a_little_more), "J12.38"
    ),
}  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_of_the_library_is_noticed(fault, monkeypatch):
    """The formula comes out of the code that is broken here."""
    (owner, name, twin), equation = FAULTS[fault]
    frequency.travel.cache_clear()
    assert all(map(vanishes, EQUATIONS[equation]()))
    monkeypatch.setattr(owner, name, twin)
    frequency.travel.cache_clear()
    assert not all(vanishes(opaque(e)) for e in EQUATIONS[equation]())
    frequency.travel.cache_clear()


def test_one_equation_stands_in_one_module(monkeypatch):
    monkeypatch.setattr(irradiance, "DERIVED", {"R07.25": EQUATIONS["R07.25"]})
    with pytest.raises(ValueError, match=r"R07\.25 is derived twice"):
        equations()
