import numpy as np
import pytest
import sympy

from derivations.derived.compare import normal
from derivations.derived.frequency import DERIVED
from firstorder import symbolic
from firstorder.errors import Refused
from firstorder.fields import gaussian
from firstorder.symbolic import Effect, EffectTable, UnknownField, effects, event, table_1
from firstorder.transport import Bump, Curvature, Gather, Mirror, Travel

ROWS = {
    "travel": ("D05.T1.1", "shear", "shear"),
    "light incidence": ("D05.T1.3", "flip, scale", "flip, scale"),
    "outgoing angle": ("D05.T1.4", "scale", "scale"),
    "curvature": ("D05.T1.5", "shear", "shear"),
    "mirror": ("D05.14", "flip", "flip"),
    "BRDF": ("D05.T1.7", "convolution", "multiplication"),
    "texture mapping": ("D05.T1.8", "multiplication", "convolution"),
    "separable BRDF": (
        "D05.T1.9",
        "multiplication, flip, convolution",
        "convolution, flip, multiplication",
    ),
    "space-varying BRDF": ("D05.T1.10", "semi-convolution", "semi-convolution"),
}


@pytest.fixture(scope="module")
def table():
    return effects()


@pytest.mark.parametrize("name", ROWS)
def test_it_is_table_1_of_d05(table, name):
    equation, on_light, on_spectrum = ROWS[name]
    (row,) = (row for row in table.rows if row.name == name)
    assert isinstance(row, Effect)
    assert (row.on_light, row.on_spectrum) == (on_light, on_spectrum)
    printed = normal(DERIVED[equation].printed())
    assert sympy.simplify(normal(row.spectrum.expression) - printed) == 0
    assert normal(row.spectrum.expression) != 1.001 * printed


def test_it_has_the_rows_of_the_paper_and_the_mirror(table):
    assert isinstance(table, EffectTable)
    assert [row.name for row in table.rows] == list(table_1())
    assert set(table_1()) - set(ROWS) == {"visibility", "cosine term"}  # integrals, like texture's
    assert "\n  spectrum (shear): L_hat(Omega_x, Omega_v + Omega_x*d)\n" in str(table)


def test_a_notebook_shows_a_table(table):
    lines = table._repr_markdown_().splitlines()
    assert len(lines) == 2 + len(table.rows)
    assert all(line.count("|") == 6 for line in lines)
    assert "\\hat{L}\\left(\\Omega_{x}, \\Omega_{v} + \\Omega_{x} d\\right)" in lines[2]


def test_steps_of_ones_own():
    x, theta, f = sympy.symbols("x theta f")
    lens = event({theta: theta - x / f}, parameters={f: f})
    own = {
        "lens": lens,
        "bump": Bump(UnknownField("n", ("x",))),
        "gather": Gather(reach=9.0),
        "twice": Curvature(0.5) >> Mirror(),
    }
    rows = {row.name: row for row in effects(own).rows}
    assert rows["lens"].on_light == "shear"
    assert isinstance(rows["bump"].spectrum, Refused)
    assert rows["bump"].on_spectrum == "no simple formula"
    assert (rows["gather"].on_light, rows["gather"].on_spectrum) == ("integral", "slice")
    assert rows["twice"].on_light == "shear, flip"
    light = gaussian((0.2, 0.1), (0.5, 0.3), 0.3)
    found = rows["lens"].light.lower(L=light)(0.3, 0.1, f=2.0)
    np.testing.assert_allclose(found, light(0.3, 0.1 + 0.3 / 2.0), rtol=1e-12)


def test_a_step_that_takes_no_light_of_flatland_is_refused():
    with pytest.raises(ValueError, match="takes no light of flatland"):
        effects({"two mirrors": Mirror() >> Mirror()})


def test_what_moves_nothing_but_the_origin_is_no_flip():
    rows = effects({"step": event({"x": sympy.Symbol("x") + 1}), "mirror": Mirror()}).rows
    assert [row.on_light for row in rows] == ["shift", "flip"]
    assert [row.on_spectrum for row in rows] == ["phase", "flip"]


def test_steps_have_names():
    with pytest.raises(TypeError):
        symbolic.effects([Travel(1.0)])
