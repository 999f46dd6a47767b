import jax
import jax.numpy as jnp
import numpy as np
import pytest

from derivations.caching._light import lamp, scene_a_columns
from firstorder import caching
from firstorder.caching import Candidates, candidates

PLACES = np.random.default_rng(0).uniform(size=(12, 2))


def test_candidates_hold_the_closed_form_and_its_derivatives():
    at = np.linspace(-1.0, 1.0, 9)
    found = Candidates.from_function(lamp, at, derivatives=3)
    columns = np.stack([found.derivative(k).reshape(9) for k in range(4)], -1)
    np.testing.assert_allclose(columns, scene_a_columns(at), rtol=0.0, atol=1e-13)
    assert np.all(np.isinf(found.minimum))
    assert found.tilt is None


def test_on_a_plane_every_derivative_is_that_of_a_cubic(monkeypatch):
    """In blocks of places, each compiled once."""
    monkeypatch.setattr(candidates, "BLOCK", 5)

    def E(x):
        return x[0] ** 2 * x[1] + 2.0 * x[1] ** 3

    found = Candidates.from_function(E, PLACES, derivatives=3)
    x, y = PLACES.T
    np.testing.assert_allclose(found.gradient, np.stack([2 * x * y, x**2 + 6 * y**2], -1))
    H = np.array([[2 * y, 2 * x], [2 * x, 12 * y]])
    np.testing.assert_allclose(found.derivative(2), np.moveaxis(H, -1, 0))
    T = np.array([[[0.0, 2.0], [2.0, 0.0]], [[2.0, 0.0], [0.0, 12.0]]])
    np.testing.assert_allclose(
        found.derivative(3), np.broadcast_to(T, (12, 2, 2, 2)), rtol=0.0, atol=1e-14
    )


def test_loops_of_an_unknown_length_are_differentiated():
    def E(x):
        return jax.lax.while_loop(lambda s: s < 3.0, lambda s: s * x[0], x[0])

    found = Candidates.from_function(E, np.array([[2.0]]), derivatives=3)
    # x^2 where the loop runs once.
    assert [found.derivative(k).item() for k in range(4)] == [4.0, 4.0, 2.0, 0.0]


def test_columns_along_a_line_are_tensors():
    at = np.linspace(-1.0, 1.0, 5)
    found = Candidates.on_line(at, scene_a_columns(at), tilt=at, minimum=0.5)
    assert (found.count, found.dims) == (5, 1)
    for k in range(4):
        assert found.derivative(k).shape == (5,) + (1,) * k
        np.testing.assert_array_equal(found.derivative(k).reshape(5), scene_a_columns(at)[:, k])
    np.testing.assert_array_equal(found.at(slice(1, 3)).tilt, at[1:3, None])
    assert np.all(found.minimum == 0.5)


@pytest.mark.smoke
@pytest.mark.parametrize(
    ("call", "words"),
    [
        (
            lambda: Candidates.of(PLACES, np.ones(3), PLACES),
            r"^Argument `value` must have shape \(12,\), but has \(3,\).$",
        ),
        (
            lambda: Candidates.of(PLACES, np.full(12, np.nan), PLACES),
            r"^Argument `value` must be finite, but is nan.$",
        ),
        (
            lambda: Candidates.of(np.zeros((4, 3)), np.ones(4), np.ones((4, 3))),
            r"^Argument `position` must have shape \(m, 1\) or \(m, 2\), but has \(4, 3\).$",
        ),
        *(
            (
                lambda name=name: Candidates.of(
                    PLACES, np.ones(12), PLACES, **{name: np.zeros((3, 2)[: 1 + (name == "tilt")])}
                ),
                rf"^Argument `{name}` must broadcast to shape \(12",
            )
            for name in ("tilt", "minimum", "harmonic")
        ),
        (
            lambda: Candidates.on_line(np.zeros(1), np.ones((1, 1))),
            r"^Argument `columns` must hold 2 to 4 columns, but has shape \(1, 1\).$",
        ),
        (
            lambda: Candidates.from_function(jnp.sin, PLACES),
            r"^Argument `E` must give one number, but gives an array of shape \(2,\).",
        ),
        (
            lambda: Candidates.from_function(jnp.sin, PLACES[:, 0], derivatives=4),
            r"^Argument `derivatives` must be 1, 2 or 3, but is 4.$",
        ),
        (
            lambda: Candidates.of(PLACES, np.ones(12), PLACES).derivative(2),
            r"^Argument `hessian` must be given for order 2, but is missing.$",
        ),
    ],
)
def test_bad_input_is_one_sentence(call, words):
    with pytest.raises(ValueError, match=words):
        call()


@pytest.mark.parametrize("dims", [1, 2])
def test_no_places_make_no_candidates(dims):
    none = Candidates.from_function(lambda x: jnp.sum(x), np.zeros((0, dims)), derivatives=3)
    assert none.count == 0
    assert np.shape(none.third) == (0, dims, dims, dims)


def test_rows_are_those_that_are_there():
    line = Candidates.from_function(jnp.cos, jnp.linspace(0.0, 1.0, 5))
    np.testing.assert_array_equal(line.at([0, 2]).position[:, 0], [0.0, 0.5])
    np.testing.assert_array_equal(jax.jit(lambda k: line.at(k).value)(2), line.value[2])
    with pytest.raises(IndexError, match="out of bounds"):
        line.at(np.array([7]))


@pytest.mark.parametrize("name", ["position", "value", "gradient"])
def test_complex_numbers_are_refused(name):
    given = {"position": np.zeros(1), "value": np.ones(1), "gradient": np.zeros((1, 1))}
    with pytest.raises(ValueError, match=f"Argument `{name}` must be real, but is complex"):
        caching.Candidates.of(**given | {name: np.asarray(given[name]) + 1j})


@pytest.mark.parametrize("name", ["minimum", "harmonic"])
@pytest.mark.parametrize("wrong", [np.nan, -1.0])
def test_lengths_of_rays_are_not_negative(name, wrong):
    with pytest.raises(ValueError, match=f"Argument `{name}` must not be negative"):
        caching.Candidates.of(np.zeros(1), np.ones(1), np.zeros((1, 1)), **{name: wrong})
