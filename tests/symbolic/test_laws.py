"""A column of the squares: each formula, lowered to numbers, against the portraits by conversion.

A formula is read out of the code of a law, so the faults of its rules are faults of the formula,
and must be seen here as well. Quadratures are no formulas: those of `Integrate` and `Convolve` are
written as integrals, and faults of how these are computed are judged by the other columns.
"""

import functools

import numpy as np
import pytest
import sympy

from firstorder.checks.registry import all_cases, all_faults
from firstorder.checks.squares import _converted_once
from firstorder.checks.tolerance import normwise
from firstorder.errors import Refused
from firstorder.symbolic import Derivation
from firstorder.transport import Chain

PORTRAITS = ("value", "gradient", "hessian", "spectrum", "covariance")
# What has numbers and no formula: searches of scenes, tables, gratings that round to the next bar,
# and transforms of factors that are not waves, bells or humps.
WITHOUT = {name for name in all_cases() if "scene" in name} | {"tabulate", "occlusion, grating"}
NO_SPECTRUM = {
    "multiply, not a bell",
    "multiply, an edge",
    "fresnel",
    "total reflection",
    "transmission",
    "refraction into glass",
    "refraction out of glass",
    "occlusion",
    "occlusion at two depths",
    "occlusion, half-plane",
    "occlusion, slit",
    "occlusion, comb",
    "occlusion, grating",
    "separable BRDF",
    "shadow of a half-plane",
    "shadow of a comb",
    "multiply in space, 24^4",
    "multiply in space, 25^4",
}
CELLS = [(name, portrait) for name in all_cases() for portrait in PORTRAITS]
READ = {
    name
    for name in all_cases()
    if name not in WITHOUT
    and not any(word in name for word in ("integrate", "convolve", "BRDF", "reflection", "shadow"))
}
FAULTS = [
    (name, fault.name, portrait)
    for name in sorted(READ)
    for fault in all_faults().get(name, ())
    for portrait in fault.portraits
    # (the cosine's faults are no humps, or faults of its numeric transform)
    if portrait == "value" or (portrait == "spectrum" and name not in NO_SPECTRUM | {"cosine"})
]


def path(name, step):
    """The formulas of a step, law, event or chain, on the light of its case."""
    events = step.events if isinstance(step, Chain) else (step,)
    return Derivation(all_cases()[name].field, events)


@functools.lru_cache(maxsize=4)
def derived(name):
    return path(name, all_cases()[name].step)


@functools.lru_cache(maxsize=4)
def jets(name):
    """Value, gradient and Hessian at the rays of a case: one program for the three."""
    found, case = derived(name), all_cases()[name]
    parts = found.value.expression, *found.gradient.expression, *found.hessian.expression
    values = np.asarray(found.value.mapped(lambda _: sympy.Array(parts)).at(*case.rays.T))
    n = len(found.value.coordinates)
    hessian = values[:, 1 + n :].reshape(-1, n, n)
    return {"value": values[:, 0], "gradient": values[:, 1 : 1 + n], "hessian": hessian}


def numbers(found, case, portrait):
    """The portrait's formula at the rays, or frequencies, of a case."""
    formula = getattr(found, portrait)
    if portrait == "spectrum":
        return np.asarray(formula.at(*np.meshgrid(*case.frequencies, indexing="ij")))
    if portrait == "covariance":
        return np.asarray(formula.at(*[0.0] * len(formula.coordinates)))
    return np.asarray(formula.at(*case.rays.T))


@pytest.mark.parametrize(("name", "portrait"), CELLS)
def test_a_formula_is_the_portrait(name, portrait):
    case = all_cases()[name]
    refused = case.expected.get(portrait) == "refused" or name in WITHOUT
    if refused or (portrait == "spectrum" and name in NO_SPECTRUM):
        with pytest.raises(Refused):
            numbers(derived(name), case, portrait)
        return
    smooth = portrait in ("value", "gradient", "hessian")
    found = jets(name)[portrait] if smooth else numbers(derived(name), case, portrait)
    error = normwise(found, _converted_once(case, portrait))
    assert error <= case.bound(portrait)


@pytest.mark.parametrize(("name", "fault", "portrait"), FAULTS)
def test_every_fault_of_a_rule_is_one_of_its_formula(name, fault, portrait):
    case = all_cases()[name]
    (wrong,) = (f.wrong(case.step) for f in all_faults()[name] if f.name == fault)
    found = numbers(path(name, wrong), case, portrait)
    assert not normwise(found, _converted_once(case, portrait)) <= case.bound(portrait)
