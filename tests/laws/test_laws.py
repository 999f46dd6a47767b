"""What holds for all five laws: superposition, jit, float32, no NaN."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstorder.checks.cases import light
from firstorder.checks.registry import all_cases
from firstorder.checks.table import LAWS
from firstorder.fields import Sum, gaussian
from firstorder.laws import FieldImage
from firstorder.numerics._batching import batched

OTHER = gaussian((-0.3, 0.4), (0.7, 0.5), -0.2, 0.6)
WEIGHT = st.floats(-3.0, 3.0)


@eqx.filter_jit
def both_ways(law, a, b, rays):
    """Jets of the law on a superposition, and the superposition of its jets."""
    f, g = light(), OTHER
    whole = batched(law(Sum((f, g), jnp.stack([a, b]))).jet)(rays)
    parts = [batched(law(h).jet)(rays).scaled(w) for h, w in ((f, a), (g, b))]
    return whole, parts[0] + parts[1]


@eqx.filter_jit
def spectra_both_ways(law, a, b, Omega):
    f, g = light().spectrum(), OTHER.spectrum()
    whole = law(Sum((light(), OTHER), jnp.stack([a, b])).spectrum()).at(Omega)
    return whole, a * law(f).at(Omega) + b * law(g).at(Omega)


@pytest.mark.parametrize("name", [*LAWS, "integrate, moving ends", "convolve, hemisphere"])
@given(a=WEIGHT, b=WEIGHT)
def test_every_law_is_linear_in_the_light(name, a, b):
    case = all_cases()[name]
    left, right = both_ways(case.step, jnp.asarray(a), jnp.asarray(b), jnp.asarray(case.rays))
    jax.tree.map(lambda p, q: np.testing.assert_allclose(p, q, rtol=0.0, atol=1e-11), left, right)


@pytest.mark.parametrize("name", ["multiply", "integrate", "convolve", "move"])
@given(a=WEIGHT, b=WEIGHT)
def test_spectra_are_linear_in_the_light(name, a, b):
    case = all_cases()[name]
    Omega = jnp.stack([jnp.asarray(o[1]) for o in case.frequencies])
    left, right = spectra_both_ways(case.step, jnp.asarray(a), jnp.asarray(b), Omega)
    np.testing.assert_allclose(left, right, rtol=0.0, atol=1e-12)


@eqx.filter_jit
def jets_of(field, rays):
    return batched(field.jet)(rays)


@pytest.mark.smoke
@pytest.mark.parametrize("name", LAWS)
def test_every_law_works_in_single_precision(name):
    case = all_cases()[name]
    single = lambda tree: jax.tree.map(  # noqa: E731
        lambda a: jnp.asarray(a, jnp.float32) if eqx.is_inexact_array(a) else a, tree
    )
    with jax.enable_x64(False):
        field = single(case.step)(single(case.field))
        rays = jnp.asarray(case.rays, jnp.float32)
        jets = jets_of(field, rays)
    truth = jets_of(case.step(case.field), jnp.asarray(case.rays))
    for part in ("value", "gradient", "hessian"):
        a = getattr(jets, part)
        assert a.dtype == jnp.float32
        np.testing.assert_allclose(a, getattr(truth, part), rtol=0.0, atol=3e-5)


def test_a_thing_that_is_no_portrait_is_refused():
    with pytest.raises(TypeError, match="portrait"):
        all_cases()["move"].step(1.0)


@pytest.mark.parametrize("name", LAWS)
def test_the_image_of_a_field_is_the_law_at_every_ray(name):
    case = all_cases()[name]
    image = case.step(case.field)
    assert isinstance(image, FieldImage)
    assert image.frame == case.step.frame(case.field.frame)
    assert len(image.edges()) == len(case.step.edges(case.field))
