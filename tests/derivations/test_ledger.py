import importlib

import pytest

from derivations import table
from derivations.catalogue import load
from firstorder.ledger import Check

ROWS = [row for _, row in table().values() if row.symbolic is not None]
# Identities with a proof and one numeric route, because the statement admits no other.
ONE_ROUTE = {
    "C.zonal.spectrum": "Legendre multipliers: the transform is the statement",
    "R07.fig2.multiply.wavelet": "about coefficients: neither derivative nor Fourier transform",
    "E11.sBa": "a count: samples of a grid are counted",
    "E11.sBb": "where a wave's transform stands: measured",
    "C.space.contour": "a flux: integrated over the face of a triangle",
    "R07.sDa": "two formulas for one edge: compared",
    "R07.s7.2a": "what (47) is called: compared with the solid angle",
    "D05.s4.1h": "geometry of a circle: traced, and nothing to transform",
    "D05.s5.2a": "the name of an angle: evaluated",
    "D05.s6.2a": "a line in frequency space: measured on the light",
    # J12's theory is one of integrals: nothing to differentiate, and no spectrum.
    **dict.fromkeys(("J12.11", "J12.12"), "a ratio of areas: measured on a tilted patch"),
    **dict.fromkeys(
        ("J12.13", "J12.14", "J12.15", "J12.16", "J12.40"),
        "an integral of radiance over angles: crossed strings, discs, quadrature",
    ),
    **dict.fromkeys(
        ("J12.23", "J12.24", "J12.25", "J12.27", "J12.31", "J12.32"),
        "reflected light as an integral: rays summed, furnaces filled",
    ),
    "J12.36": "a product rule with a distribution in it: edges summed against the irradiance",
    **dict.fromkeys(("J12.41", "J12.43", "J12.44"), "a sum in another order: evaluated"),
    "R07.fn2": "a symmetry of lobes: evaluated",
    "R07.s8.1a": "a union of intervals: merged",
    "R07.s9.3a": "what lines leave of a picture: measured",
    "J12.s3.2a": "a normalisation: summed",
    "J12.s4.2a": "a density: the slope of its map",
    "J12.s7.1a": "geometry of a moving wall: proved",
    "D05.s4b": "coefficients around a circle: summed",
    "E11.fn1": "a spectrum in another notation: summed",
    "E11.fig6": "a mean of depths: found by bisection",
    "E11.fig18a": "a shared opening: rays past bars",
    # What is wrong in words: a term, a name, an axis.
    "R07.s3.1a": "the size of a transform: summed",
    "R07.s7.1a": "the name of an angle: evaluated",
    "R07.s9.1d": "the name of a gradient: differenced",
    "J12.s4.4a": "which photons are summed: thrown",
    "J12.s5.1a": "which end is first: summed",
    "J12.s8.3a": "eigenvalues for eigenvectors: evaluated",
    "J12.s8.4a": "directions for curvatures: evaluated",
    "J12.s9a": "the rank of a tensor: evaluated",
    "E11.s4a": "which axis is sheared: waves on planes",
    **dict.fromkeys(
        ("D05.s0a", "D05.s3.4e", "D05.s4.2d", "D05.s4.5e", "D05.s4.5f"),
        "which part of a spectrum: samples transformed",
    ),
    "D05.s5.2i": "a map or a form: the normals of a ball",
    "C.bandwidth.slope": "a number of changes: counted",
    "C.bandwidth.density": "an optimum: searched",
    "C.relief.pits": "rays between mirrors: traced",
    "C.radiosity.corner": "an exponent: fitted to the solution",
    "C.radiosity.energy": "a balance of fluxes: summed",
    "C.refraction.energy": "a balance of fluxes: summed",
}
WRONG_IN_PRINT = [r for r in ROWS if r.counterexample]


def test_every_numbered_equation_is_listed():
    numbered = [e for e in table().values() if e[0].numbered]
    assert len(numbered) == 198


def test_every_row_stands_in_the_catalogue_once():
    ids = [r.equation for r in ROWS]
    assert len(ids) == len(set(ids))
    assert set(ids) <= set(load())


@pytest.mark.parametrize("row", [r for r in ROWS if r.implements], ids=lambda r: r.equation)
def test_what_a_row_says_it_implements_exists(row):
    module, _, rest = row.implements, "", ""
    while True:
        try:
            found = importlib.import_module(module)
            break
        except ModuleNotFoundError:
            module, _, last = module.rpartition(".")
            rest = f"{last}.{rest}" if rest else last
            assert module, row.implements
    for name in filter(None, rest.split(".")):
        found = getattr(found, name)
    assert found is not None


@pytest.mark.parametrize("row", WRONG_IN_PRINT, ids=lambda r: r.equation)
def test_a_counterexample_shows_that_the_print_is_wrong(row):
    c = row.counterexample
    printed, true = float(c.printed(**c.inputs)), float(c.true(**c.inputs))
    assert abs(printed - true) > 1e-3 * max(abs(printed), abs(true)), (printed, true)


@pytest.mark.parametrize(
    "row", [r for r in ROWS if r.kind in ("identity", "misprint")], ids=lambda r: r.equation
)
def test_an_identity_has_a_proof_and_two_numeric_routes_or_says_why_not(row):
    routes = (row.autodiff, row.fourier, row.brute_force)
    assert row.symbolic is not None
    assert all(route is not None for route in routes)
    assert callable(row.symbolic)
    numeric = sum(isinstance(route, Check) for route in routes)
    assert numeric >= 2 or row.equation in ONE_ROUTE


@pytest.mark.parametrize("equation", [e for e, (entry, _) in table().items() if entry.issue <= 2])
def test_everything_in_the_scope_of_the_calculus_and_of_flatland_has_a_row(equation):
    assert equation in {r.equation for r in ROWS}
