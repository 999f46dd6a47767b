import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.caching import (
    SurfaceCache,
    SurfaceCandidates,
    circular_regions,
    elliptic_regions,
    surface_cache,
    surface_taylor,
)
from firstorder.io import write_csv


def E(x):
    """A field with slopes of every kind, in exact arithmetic below."""
    return 2.0 + x[0] ** 2 * x[1] - 0.5 * x[1] ** 2 + x[0]


PLACES = np.random.default_rng(0).uniform(size=(12, 2))
WHERE = np.concatenate([np.random.default_rng(1).uniform(size=(60, 2)), PLACES[:2], [[5.0, 5.0]]])


@pytest.fixture(scope="module")
def some():
    return SurfaceCandidates.on(E, PLACES)


@pytest.fixture(scope="module")
def reach(some):
    return jax.jit(lambda H: elliptic_regions(H, 0.01, 0.1, 0.6))(some.hessian)


def slowly(some, reach, order, fade):
    """The weighted mean, record by record."""
    value, covered = [], []
    for place in WHERE:
        parts = []
        for i in range(len(PLACES)):
            dx = place - np.asarray(some.position[i])
            there = some.value[i]
            there += (np.asarray(some.gradient[i]) @ dx) if order > 0 else 0.0
            there += 0.5 * dx @ np.asarray(some.hessian[i]) @ dx if order > 1 else 0.0
            parts.append((np.linalg.norm(np.asarray(reach.matrix[i]) @ dx), float(there)))
        reached = [(1.0 / (e + 1e-300) - fade, t) for e, t in parts if e < 1.0]
        covered.append(bool(reached))
        w, t = np.array(reached or [(1.0, min(parts)[1])]).T
        value.append(w @ t / w.sum() if w.max() < 1e200 else t[np.argmax(w)])
    return np.array(value), covered


CASES = [(0, False), (1, False), (2, True)]


@pytest.mark.parametrize(("order", "fade"), CASES)
def test_answers_are_weighted_means_of_expansions(some, reach, order, fade):
    value, covered = slowly(some, reach, order, fade)
    answer = SurfaceCache.of(some, reach, order=order, fade=fade)(WHERE)
    np.testing.assert_allclose(answer.value, value, rtol=1e-9)
    assert np.asarray(answer.covered).tolist() == covered
    assert 20 < sum(covered) < len(covered)


def test_a_plane_is_exact_and_records_keep_their_values(some, reach):
    cache = SurfaceCache.of(some, reach)
    np.testing.assert_allclose(cache(PLACES).value, some.value, rtol=1e-12)
    flat = SurfaceCandidates.of(PLACES, 1.0 + PLACES @ [2.0, 3.0], np.tile([2.0, 3.0], (12, 1)))
    answer = SurfaceCache.of(flat, reach)(WHERE)
    np.testing.assert_allclose(answer.value, 1.0 + WHERE @ [2.0, 3.0], rtol=1e-12)


def test_a_gradient_turned_round_is_noticed(some, reach, monkeypatch):
    """Wrong twins of the expansion: the fault, seen by the same check."""
    value, _ = slowly(some, reach, 1, False)

    def turned(value, gradient, hessian, dx, order):
        return surface_taylor(value, gradient[..., ::-1], hessian, dx, order)

    monkeypatch.setattr(surface_cache, "surface_taylor", turned)
    # Another number of records, so that nothing compiled before is used.
    monkeypatch.setattr(surface_cache, "PAD", 64)
    answer = SurfaceCache.of(some, reach)(WHERE)
    assert 1e-2 < np.max(np.abs(np.asarray(answer.value) - value)) < np.inf


@pytest.mark.smoke
def test_chosen_rows_and_the_table(some, reach, tmp_path):
    cache = SurfaceCache.of(some, reach, np.arange(12) < 3)
    assert cache.count == 3
    columns = cache.columns()
    assert list(columns)[:3] == ["x", "y", "E"]
    assert len(str(cache).splitlines()) == 4
    write_csv(tmp_path / "cache.csv", columns)
    read = np.genfromtxt(
        tmp_path / "cache.csv", delimiter=",", names=True, dtype=None, encoding="utf-8"
    )
    again = SurfaceCache.from_columns({k: read[k] for k in read.dtype.names or ()})
    np.testing.assert_allclose(again.matrix, cache.matrix, rtol=1e-9)
    np.testing.assert_allclose(again(WHERE).value, cache(WHERE).value, rtol=1e-9)
    assert again.clamp.tolist() == cache.clamp.tolist()


def test_axes_of_a_record_are_those_of_its_matrix(some, reach):
    cache = SurfaceCache.of(some, reach)
    lengths, angle = cache.semi_axes()
    for M, (a, b), t in zip(np.asarray(cache.matrix), lengths, angle, strict=True):
        u, v = np.array([np.cos(t), np.sin(t)]), np.array([-np.sin(t), np.cos(t)])
        assert np.linalg.norm(M @ (a * u)) == pytest.approx(1.0)
        assert np.linalg.norm(M @ (b * v)) == pytest.approx(1.0)
        assert a >= b


@pytest.mark.smoke
@pytest.mark.parametrize(
    ("call", "words"),
    [
        (
            lambda: SurfaceCandidates.of(PLACES, np.ones(3), PLACES),
            r"^Argument `value` must have shape \(12,\), but has \(3,\).$",
        ),
        (
            lambda: SurfaceCandidates.of(PLACES, np.full(12, np.nan), PLACES),
            r"^Argument `value` must be finite, but is nan.$",
        ),
        (
            lambda: SurfaceCache.from_columns({"x": np.zeros(1)}),
            r"^Argument `columns` must hold `y`, but does not.$",
        ),
        (
            lambda: SurfaceCache.of(
                SurfaceCandidates.of(PLACES, np.ones(12), PLACES),
                circular_regions(jnp.ones(12), 0.1, 1.0),
                np.zeros(12, bool),
            ),
            r"^Argument `position` must hold at least one record, but is empty.$",
        ),
    ],
)
def test_bad_input_is_one_sentence(call, words):
    with pytest.raises(ValueError, match=words):
        call()
