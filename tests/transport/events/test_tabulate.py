import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.cases import light
from firstorder.checks.tolerance import fitted_order
from firstorder.errors import Refused
from firstorder.fields import GaussianProfile, Grid, half_plane
from firstorder.laws import Convolve, Multiply
from firstorder.numerics._batching import batched
from firstorder.transport import Tabulate

U = jnp.array([0.3, -0.2])


def grid(n):
    return Grid.spanning((n, n + 1), (4.0, 4.0))


def test_the_error_of_a_table_falls_as_the_fourth_power_of_its_step():
    sizes = np.array([48, 64, 96])
    errors = [Tabulate(grid(int(n))).error(light()) for n in sizes]
    np.testing.assert_allclose(fitted_order(1.0 / sizes, errors), 4.0, rtol=0.0, atol=0.4)


def test_two_blurs_through_a_table_are_two_nested_ones():
    """A blur of integral one does not raise the table's largest error along the line it blurs."""
    blur = Convolve(GaussianProfile(0.35), nodes=40)
    once = blur(light())
    table = Tabulate(grid(128))(once)
    jets = eqx.filter_jit(lambda f, rays: batched(f.jet)(rays))
    line = jnp.stack([jnp.full(401, U[0]), jnp.linspace(-3.5, 3.5, 401)], -1)
    nested, tabulated = jets(blur(once), U[None]), jets(blur(table), U[None])
    before, after = jets(once, line), jets(table, line)
    for part in ("value", "gradient", "hessian"):
        miss = jnp.max(jnp.abs(getattr(before, part) - getattr(after, part)))
        np.testing.assert_allclose(
            getattr(tabulated, part), getattr(nested, part), rtol=0.0, atol=miss
        )


def test_a_table_stands_in_a_path():
    event = Tabulate(grid(64))
    path = light() >> event
    np.testing.assert_allclose(path.light.at(U), light().at(U), rtol=0.0, atol=event.error(light()))
    assert not isinstance(path.spectra[-1], Refused)


def test_edges_jets_and_laws_are_refused():
    table = Tabulate(grid(32))
    with pytest.raises(Refused, match="smooth the edges away"):
        table(Multiply(half_plane(0.0))(light()))
    with pytest.raises(Refused, match="jet at one ray"):
        table(light().jet(U))
    with pytest.raises(Refused, match="jet at one ray"):
        table.push(light().jet(U), U)
    with pytest.raises(Refused, match="whole field"):
        table.law(light().frame)


def test_a_grid_of_another_dimension_is_refused():
    with pytest.raises(ValueError, match="Tabulate needs a grid of 2 axes"):
        Tabulate(Grid((8,), (0.1,)))(light())
