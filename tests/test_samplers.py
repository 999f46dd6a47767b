"""Every place of the library that draws random numbers has a test of their distribution."""

import ast
import pathlib

import numpy as np
import pytest

from firstorder.checks.statistics import LEVEL
from tests.samplers import COUNT, biased, disc_place, uniform_p_value

ROOT = pathlib.Path(__file__).resolve().parents[1]

# By module and function: the chi-square test of what it draws.
TESTED = {
    "sampling.strata.jittered": "sampling/test_strata.py::test_all_together_are_uniform",
    "sampling._paths.walk": "sampling/test_paths.py::test_paths_are_as_long_as_their_chance_says",
    "flatland.bounces.photons._thrown": "flatland/bounces/test_photons.py::test_what_is_sent",
    "flatland.estimators.strata.hemicircle_strata": (
        "flatland/estimators/test_strata.py::test_directions_in_a_sector_follow_its_measure"
    ),
    "space.estimators.strata.hemisphere_strata": (
        "space/estimators/test_strata.py::test_directions_in_a_cell_follow_its_measure"
    ),
    "space.estimators._triangulation._directions": (
        "space/estimators/test_triangulation.py::test_directions_come_by_their_cosine"
    ),
    "shadowfield.rendering.ray_table.trace_shadow_rays": (
        "shadowfield/rendering/test_ray_table.py::test_feet_and_receivers_come_evenly"
    ),
    "shadowfield.rendering.ray_table._spread": (
        "shadowfield/rendering/test_ray_table.py::test_feet_and_receivers_come_evenly"
    ),
    "shadowfield.rendering.scene_rays.own_visibility": (
        "shadowfield/rendering/test_scene_rays.py::test_own_rays_come_evenly"
    ),
    "shadowfield.rendering.sample_counts.distribute_rays": (
        "shadowfield/rendering/test_sample_counts.py::test_shares_of_a_ray_are_rounded_evenly"
    ),
    "caching.candidate_tables.gather_directions": (
        "caching/test_candidate_tables.py::test_gather_directions_come_by_their_cosine"
    ),
    "caching.filling.random_orders": "caching/test_filling.py::test_every_order_comes_as_often",
    "space.bounces.photons._thrown": (
        "space/bounces/test_photons.py::test_photons_of_even_directions_are_noticed"
    ),
}

# What is given uniform numbers and turns them into directions, places and choices.
GIVEN = {
    "sampling._distributions": "sampling/test_distributions.py::test_samples_follow_the_density",
    "sampling._distributions.Discrete": "sampling/test_distributions.py::test_picks_come_by_weight",
    "sampling._paths.roulette": (
        "sampling/test_paths.py::test_paths_are_as_long_as_their_chance_says"
    ),
    "flatland.bounces._scatter.scatter": (
        "flatland/bounces/test_pathtrace.py::test_scattered_directions_follow_their_density"
    ),
    "flatland.bounces._light_sampling.sample_light": (
        "flatland/bounces/test_light_sampling.py::test_lights_and_places_on_them_follow_their_law"
    ),
    "space.bounces._vertices.scattered": (
        "space/bounces/test_pathtrace.py::test_directions_follow_their_density"
    ),
    "space.bounces._focus.spread": (
        "space/bounces/test_focus.py::test_places_on_a_plane_are_even_as_seen_from_above_the_foot"
    ),
    "space.bounces._focus.aimed": (
        "space/bounces/test_focus.py::"
        "test_half_of_the_directions_lie_about_the_ball_evenly_at_every_scale"
    ),
    "space.bounces._surface_points.point_on": (
        "space/bounces/test_pathtrace.py::test_points_of_a_light_are_even_by_area"
    ),
    "imaging.sky_lights._by_luminance": (
        "imaging/test_sky_lights.py::test_directions_of_a_bright_sky_come_by_its_luminance"
    ),
    "figures.e11.competitors.baselines.on_lamp": (
        "figures/competitors/test_baselines.py::test_places_come_by_the_light_of_the_lamp"
    ),
}

# What draws, but no samples of a density.
OTHERS = {
    "sampling._paths.follow_photons": "roulette and scattering are tested by themselves",
    "flatland.bounces.pathtrace._trees": "its lobes and lights are tested by themselves",
    "flatland._radiometry.reflected_radiance_over_curves": "one number in each equal piece",
    "flatland.estimators._irradiance_forms.arc_length_estimate_on_curves": (
        "one number in each equal piece"
    ),
    "caching.candidate_tables.tabulate_candidates": "which set of directions a place is given",
    "reconstruction.blue_noise._ranks": "where the search for an even pattern begins",
    "models.primitives": "shapes, not samples",
    "models.plants": "shapes, not samples",
    "flatland.library._e11": "places of blockers, not samples",
    "space.library._scenes": "places of blockers, not samples",
    "checks.own_events": "inputs of a check",
    "symbolic._edges._is_zero_on": "numbers at which a formula is asked",
}

DRAWS = ("random", "uniform", "permutation", "normal", "integers", "choice")


def drawing():
    """Functions that ask a random generator, by their dotted names below `firstorder`."""
    for path in sorted((ROOT / "src" / "firstorder").rglob("*.py")):
        module = ".".join(path.relative_to(ROOT / "src" / "firstorder").with_suffix("").parts)
        text = path.read_text(encoding="utf-8")
        for node in ast.parse(text).body if "random" in text else ():
            if isinstance(node, (ast.FunctionDef, ast.ClassDef)) and draws(node):
                yield f"{module}.{node.name}"


def draws(node):
    """Whether a piece of syntax asks `jax.random` for numbers, or a generator of NumPy."""
    calls = (n for n in ast.walk(node) if isinstance(n, ast.Call))
    names = [ast.unparse(call.func) for call in calls]
    numpys = any(name.endswith("default_rng") for name in names)
    return numpys or any(
        name.endswith(DRAWS) and ("jax.random" in name or name.split(".")[0] == "rng")
        for name in names
    )


def known(name):
    """Whether a name, or the module that it is in, has a test or a reason."""
    return name in TESTED or name in OTHERS or name.rpartition(".")[0] in OTHERS


def test_whatever_draws_has_its_test_or_its_reason():
    assert [name for name in drawing() if not known(name)] == []


def test_what_is_named_here_draws():
    found = set(drawing())
    modules = {name.rpartition(".")[0] for name in found}
    assert [name for name in TESTED if name not in found] == []
    assert [name for name in OTHERS if name not in found | modules] == []


@pytest.mark.parametrize("where", sorted({*TESTED.values(), *GIVEN.values()}))
def test_the_test_is_there(where):
    file, _, name = where.partition("::")
    assert f"def {name}(" in (ROOT / "tests" / file).read_text(encoding="utf-8")


def test_who_draws_is_seen():
    body = "def f(rng, key):\n    return {}\n"
    seen = ["jax.random.uniform(key)", "np.random.default_rng(0)", "rng.permutation(3)"]
    assert all(draws(ast.parse(body.format(call))) for call in seen)
    assert not draws(ast.parse(body.format("jax.random.split(key)")))


def test_uniform_numbers_pass_and_others_do_not():
    u = np.random.default_rng(2).random((COUNT, 2))
    disc = np.sqrt(u[:, :1]) * np.stack(
        [np.cos(2 * np.pi * u[:, 1]), np.sin(2 * np.pi * u[:, 1])], -1
    )
    assert uniform_p_value(u) > LEVEL
    assert uniform_p_value(disc_place(disc)) > LEVEL
    assert uniform_p_value(disc_place(disc * u[:, :1])) < LEVEL
    assert uniform_p_value(biased(u, 1)) < LEVEL
    assert uniform_p_value(u + 1e-3) == 0.0
