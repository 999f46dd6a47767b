"""One scene in all ways: they agree on several scenes, and each is seen to differ once broken."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.agreements import (
    QUICK,
    Agreements,
    Found,
    Sizes,
    agreements,
    judged,
)
from firstorder.checks.agreements import _digits as decimal
from firstorder.checks.agreements import (
    _edges as edges,
)
from firstorder.checks.agreements import (
    _exact as exact,
)
from firstorder.checks.agreements import (
    _laws as laws,
)
from firstorder.checks.agreements import (
    _random as random,
)
from firstorder.checks.agreements import (
    _spectra as spectra,
)
from firstorder.checks.agreements import (
    _traced as traced,
)
from firstorder.checks.agreements import (
    _wedge as wedge,
)
from firstorder.checks.agreements._digits import digits, shifted
from firstorder.checks.agreements._irradiances import QUANTITIES, irradiance_rows
from firstorder.checks.agreements._quadrature import adaptive
from firstorder.checks.agreements._record import attempted
from firstorder.checks.agreements._spectra import spectrum_rows
from firstorder.checks.agreements._wedge import wedge_rows
from firstorder.errors import Refused
from firstorder.flatland import (
    Arcs,
    Circles,
    Ellipses,
    GaussianSky,
    Receiver,
    Scene,
    Segments,
    closed_curve,
    primitive,
    receiver,
)
from firstorder.flatland.library._scenes import named_scene
from firstorder.visibility import edge_at

# Ways that are exact or cheap (fewer where compiling takes long); random ones on one scene.
CHEAP = ("visible", "laws", "arc", "rays, a", "a cached")


def on_floor(name, s=0.63):
    scene = named_scene(name)
    return scene, receiver(scene, scene.named("floor")[0], s)


def curved():
    floor = primitive(Segments((-1.0, 0.0), (1.0, 0.0)), name="floor")
    lamp = primitive(Segments((1.0, 1.0), (-1.0, 1.0)), emission=1.0)
    bulb = primitive(Circles((-0.6, 0.8), 0.1), emission=0.5)
    bowl = primitive(Arcs((0.1, 0.5), 0.2, 0.3, 2.4))
    scene = Scene.of(floor, lamp, bulb, bowl, primitive(Ellipses((0.5, 0.6), (0.2, 0.1), 0.3)))
    return scene, receiver(scene, 0, 0.63)


def under_the_sky():
    scene = Scene.of(primitive(Circles((0.3, 0.5), 0.1)), environment=GaussianSky(0.3, 0.5))
    return scene, Receiver((0.2, 0.05), 0.2)


FEWER = {"curved": ("laws", "rays, a"), "under the sky": ("visible", "rays, a")}
SCENES = {
    "scene_a": lambda: on_floor("scene_a"),
    "scene_b": lambda: on_floor("scene_b"),
    "scene_c": lambda: on_floor("scene_c"),
    "scene_d": lambda: on_floor("scene_d"),
    "curved": curved,
    "under the sky": under_the_sky,
    "nothing visible": lambda: on_floor("fig15"),
}


@pytest.mark.parametrize("name", SCENES)
def test_ways_agree_on(name):
    rows = irradiance_rows(*SCENES[name](), QUICK, ways=FEWER.get(name, CHEAP))
    table = Agreements(name, rows)
    assert table.agrees, str(table)
    assert sum(row.verdict == "agrees" for row in rows) >= 5


def test_random_ways_mended_rays_and_the_spectrum_agree_and_print_in_100_columns():
    table = agreements(*on_floor("scene_b"), sizes=QUICK, name="scene_b")
    assert table.agrees, str(table)
    assert {row.verdict for row in table.rows} == {"reference", "agrees", "refused"}
    lines = str(table).splitlines()
    assert max(map(len, lines)) <= 100
    assert lines[0].startswith("scene_b at (0.26, 0) m")
    assert table.row("E'", "random").z is not None
    assert table.row("int |f'|^2", "second moment").verdict == "agrees"
    columns = table.columns()
    assert len(columns["value"]) == len(table.rows)
    # What has no error bar is held to fewer than ten roundings of each edge.
    assert all(float(table.row(q, "laws on").bound or 1.0) < 1e-12 for q in QUANTITIES)


# --- every way is seen to differ ----------------------------------------------------------------


def scaled(module, name, factor):
    """A function of the module, its numbers multiplied by a factor."""

    def fault(patch):
        right = getattr(module, name)

        def wrong(*args, **kwargs):
            out = right(*args, **kwargs)
            if eqx.is_inexact_array(out):
                return factor * out
            return eqx.tree_at(lambda m: _numbers(m), out, [factor * a for a in _numbers(out)])

        patch.setattr(module, name, wrong)

    return fault


def _numbers(out):
    names = ("mean", "value", "gradient", "hessian", "radiance")
    return [getattr(out, n) for n in names if hasattr(out, n)]


def turned_slope(patch):
    right = edges.point_edge_angle

    def wrong(*args, **kwargs):
        return eqx.tree_at(lambda a: a.gradient, right(*args, **kwargs), replace_fn=jnp.negative)

    patch.setattr(edges, "point_edge_angle", wrong)


def still_limb(patch):
    """A round blocker whose point of tangency does not slide."""
    right = edges.circle_edge_angle

    def wrong(center, radius, side, position, n):
        a = right(center, radius, side, position, n)
        return edge_at(a.value, 1.0 / a.distance, a.jump)

    patch.setattr(edges, "circle_edge_angle", wrong)


def no_second_order(patch):
    right = exact.receivers_along

    def wrong(*args):
        return right(*args) * np.array([1.0, 1.0, 0.0])

    patch.setattr(exact, "receivers_along", wrong)


FAULTS = {
    "intervals": ("scene_b", "intervals", scaled(exact, "irradiance", 1.001), "E E' E''"),
    "edges turn the other way": ("scene_b", "visible", turned_slope, "E'"),
    "limbs stand still": ("under the sky", "visible", still_limb, "E''"),
    "laws": ("scene_b", "laws", scaled(laws, "_cosine", 1.001), "E E' E''"),
    "arc length": (
        "scene_a",
        "arc",
        scaled(exact.irradiance_forms, "arc_length_integral", 1.001),
        "E E' E''",
    ),
    "mended": ("scene_b", "rays, e", scaled(traced, "corrected_estimate", 1.001), "E E' E''"),
    "rays": ("scene_b", "rays, a", scaled(traced, "trace_strata", 1.02), "E"),
    "cache": ("scene_b", "a cached", scaled(exact, "_extrapolated", 1.001), "E"),
    "records of first order": ("scene_b", "a cached", no_second_order, "E''"),
    "paths": ("scene_b", "random", scaled(random, "path_irradiance", 1.5), "E E'"),
    "photons": ("scene_b", "photons", scaled(random, "photon_irradiance", 2.0), "E"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_turns_its_way_red(fault, monkeypatch):
    name, way, broken, quantities = FAULTS[fault]
    broken(monkeypatch)
    table = Agreements(fault, irradiance_rows(*SCENES[name](), QUICK, ways=(way,)))
    assert {row.quantity for row in table.differing} == set(quantities.split()), str(table)
    assert all(row.way.startswith(way) for row in table.differing)


def test_a_wrong_reference_turns_all_others_red(monkeypatch):
    right = decimal._emitted
    monkeypatch.setattr(decimal, "_emitted", lambda *a: right(*a) * 1.001)
    rows = irradiance_rows(*on_floor("scene_b"), QUICK, ways=("visible", "laws"))
    assert len(Agreements("", rows).differing) == 9


def broken_wave(patch):
    def wrong(sigma, Omega, phase, x, v):
        return jnp.exp(-0.5 * (v / sigma) ** 2) * jnp.cos(2.0 * np.pi * (Omega * v + phase))

    patch.setattr(laws, "_wave", wrong)


def brighter_moment(patch):
    right = spectra.covariance_of_samples

    def wrong(samples, grid, frame):
        return eqx.tree_at(lambda S: S.matrix, right(samples, grid, frame), replace_fn=_more)

    patch.setattr(spectra, "covariance_of_samples", wrong)


def _more(matrix):
    return 1.001 * matrix


SPECTRAL = {
    "laws": (broken_wave, "laws: multiply", {"Re F", "Im F"}),
    "rays": (scaled(spectra, "discrete_transform", 1.2), "transform of traced", {"Re F"}),
    "moment": (brighter_moment, "second moment", {"int |f'|^2"}),
}


@pytest.mark.parametrize("fault", SPECTRAL)
def test_a_fault_of_the_spectrum_turns_its_way_red(fault, monkeypatch):
    broken, way, quantities = SPECTRAL[fault]
    broken(monkeypatch)
    table = Agreements(fault, spectrum_rows(*on_floor("scene_b"), QUICK))
    assert {row.quantity for row in table.differing} == quantities, str(table)
    assert all(row.way.startswith(way) for row in table.differing)


@pytest.mark.parametrize("factor", [0.7, 1.4])
def test_a_wedge_of_other_depths_loses_energy(factor, monkeypatch):
    scene, at = on_floor("scene_b")
    assert wedge_rows(scene, at, QUICK)[0].verdict == "agrees"
    right = wedge.depths_of

    def wrong(scene, at):
        blockers, depths = right(scene, at)
        return blockers, tuple(factor * z for z in depths)

    monkeypatch.setattr(wedge, "depths_of", wrong)
    assert wedge_rows(scene, at, QUICK)[0].verdict == "differs"


@pytest.mark.parametrize("gap", [1e-4, 1e-6, 1e-8])
def test_laws_hold_close_to_a_visual_event(gap):
    """Between edges nearer than the light field tells sides apart E' was half a jump wrong."""
    scene = named_scene("scene_b")
    for x in (0.1 - gap, 0.1 + gap):
        found = verdicts(scene, Receiver((x, 0.0), 0.0, 0), ("laws",))
        assert {v for v, _ in found.values()} <= {"reference", "agrees"}, found


# --- what does not apply says so ----------------------------------------------------------------


def verdicts(scene, at, ways):
    rows = irradiance_rows(scene, at, QUICK, ways=ways)
    return {(row.quantity, row.way): (row.verdict, row.reason) for row in rows}


def test_two_edges_in_line_have_no_two_sided_derivative():
    scene = named_scene("scene_b")
    found = verdicts(scene, Receiver((0.1, 0.0), 0.0), ("visible",))
    assert found["E", "visible edges (R07 36-37)"][0] == "agrees"
    assert found["E'", "50 digits, differences"] == ("refused", IN_LINE)
    assert found["E'", "intervals, autodiff"][0] == "reference"


IN_LINE = "two edges are in line here: derivatives are one-sided, and differences straddle it"


def test_refusals_give_the_reason():
    scene, at = on_floor("scene_d")
    found = verdicts(scene, at, ("laws", "arc"))
    assert "Dirac" in found["E", "laws on the light field"][1]
    assert "point lights" in found["E", "arc length (J12 37-39)"][1]
    scene, at = on_floor("scene_b")
    assert "shadow's edge" in verdicts(scene, at, ("arc",))["E'", "arc length (J12 37-39)"][1]
    crossed = Scene.of(
        primitive(Segments([(1.0, 1.0), (1.0, 0.7)], [(-1.0, 0.8), (-1.0, 1.2)]), emission=1.0)
    )
    found = verdicts(crossed, Receiver((0.0, 0.0), 0.0), ("visible", "photons"))
    assert "cross" in found["E", "visible edges (R07 36-37)"][1]
    assert "lies on none" in found["E", "photons (J12 30)"][1]
    assert found["E''", "intervals, autodiff"][0] == "agrees"


def test_without_the_50_digits_intervals_are_the_reference():
    a = 2.0 * np.pi * np.arange(64) / 64
    bean = np.stack([0.2 * np.cos(a), 0.5 + 0.1 * np.sin(a) + 0.05 * np.cos(2 * a)], -1)
    lamp = primitive(Segments((1.0, 1.0), (-1.0, 1.0)), emission=1.0)
    scene = Scene.of(primitive(closed_curve(bean, 4)), lamp)
    found = verdicts(scene, Receiver((0.3, 0.0), 0.0), ("rays, a",))
    assert found["E", "50 digits, differences"][1] == "no equations in 50 digits for kind Curves"
    assert found["E'", "intervals, autodiff"][0] == "reference"
    assert found["E", "rays, a plain sum"][0] == "agrees"


def test_a_point_lights_shadow_makes_the_mean_square_slope_infinite():
    rows = spectrum_rows(*on_floor("scene_d"), QUICK)
    reasons = {row.reason for row in rows if row.quantity == "int |f'|^2"}
    assert any("infinite" in reason for reason in reasons)
    assert not Agreements("", rows).differing
    row = wedge_rows(*on_floor("scene_d"), QUICK)[0]
    assert "every direction" in row.reason


# --- the parts ----------------------------------------------------------------------------------


def test_fifty_digits_know_reach_shadows_and_the_closed_form():
    scene, at = on_floor("scene_a")
    found = digits(scene, at)
    x = 0.26

    def sine(a):
        return a / np.hypot(a, 1.0)

    assert found.value == pytest.approx(sine(0.5 - x) + sine(0.5 + x), rel=1e-15)
    assert not found.shadows
    assert digits(*on_floor("scene_b")).shadows
    assert shifted(scene, at, [0.0])[0] == found.value
    with pytest.raises(Refused, match="sky of kind"):
        digits(Scene.of(scene_thing(), environment=lambda a: 1.0 + 0.0 * a), at)


def scene_thing():
    return primitive(Segments((1.0, 1.0), (-1.0, 1.0)), emission=1.0)


def test_the_bound_of_an_adaptive_quadrature_holds_for_jumps_anywhere():
    rng = np.random.default_rng(0)
    for _ in range(50):
        place, jump = rng.uniform(0.0, 1.0), rng.normal()
        f = lambda x, c=place, J=jump: 1.0 + J * (x > c)  # noqa: E731
        for tolerance, most in ((1e-8, 512), (1e-13, 1 << 14)):
            found = adaptive(f, 0.0, 1.0, tolerance, most)
            assert abs(found.value - 1.0 - jump * (1.0 - place)) <= found.bound


def test_judging_needs_a_reference_and_takes_no_nan():
    with pytest.raises(ValueError, match="`reference`"):
        judged("E", {"a": "does not apply"}, "a")
    rows = judged("E", {"a": Found(1.0, 0.0), "b": Found(float("nan"), 1.0)}, "a")
    assert rows[1].verdict == "differs"
    with pytest.raises(ValueError, match="must name a row"):
        Agreements("", rows).row("E'", "a")

    def refuse():
        raise Refused("no")

    assert attempted(refuse) == "no"


def test_more_than_one_receiver_is_refused():
    at = Receiver(jnp.zeros((3, 2)), jnp.zeros(3))
    with pytest.raises(ValueError, match="`at` must be one receiver"):
        agreements(named_scene("scene_a"), at)


def test_bands_and_a_receiver_at_a_point_light_are_one_sentence():
    at = Receiver((0.5, 0.5), 0.0)
    lamp = primitive(Segments((0.5, 1.0), (-0.5, 1.0)), emission=[[1.0, 0.5, 0.2], [0.0, 0.0, 0.0]])
    with pytest.raises(ValueError, match="`scene` must have no bands here, but has 3"):
        agreements(Scene.of(lamp), at)
    with pytest.raises(ValueError, match="`at` must lie beside all point lights"):
        agreements(named_scene("scene_c"), at, sizes=QUICK)


def test_edges_and_laws_give_the_same_three_numbers_without_a_judge():
    scene, at = on_floor("scene_b")
    one = edges.by_edges(scene, at, (1.0, 1.0, 1.0))
    two = laws.by_laws(scene, at, (1.0, 1.0, 1.0))
    for a, b in zip(one, two, strict=True):
        assert abs(a.value - b.value) <= a.bound + b.bound
    assert isinstance(QUICK, Sizes)
    assert QUICK.rays % 4 == 0  # halved for a bound
