"""Metrics for squares of an image: what each says of pictures whose derivatives are known."""

import numpy as np
import pytest

from derivations.reconstruction import importance as derived
from firstorder.reconstruction.importance import (
    QuadtreeCells,
    ShadedSamples,
    by_differences,
    by_gradient,
    by_hessian,
    by_hessian_differences,
    by_tangent_planes,
    by_variance,
    importance_product,
    is_far_light,
)
from firstorder.reconstruction.quadtree import sample_image

G, H = np.array([0.3, -0.7]), np.array([[0.02, 0.05], [0.05, -0.04]])


def quadratic(p):
    d = p - 16.0
    return ShadedSamples(d @ G + 0.5 * np.einsum("ni,ij,nj->n", d, H, d), G + d @ H)


def seen(shade, metric, budget=400):
    """All squares that a metric is shown."""
    kept = []

    def asked(squares):
        kept.append(squares)
        return metric(squares)

    sample_image(shade, 32, 32, budget, asked)
    return kept


def test_differences_of_gradients_are_a_quadratics_hessian():
    for squares in seen(quadratic, by_hessian_differences)[
        1:
    ]:  # one-sided at the first grid's border
        np.testing.assert_allclose(squares.bending, np.broadcast_to(H, (len(squares.size), 2, 2)))
        np.testing.assert_allclose(
            by_hessian_differences(squares), np.linalg.norm(H) * squares.size**3
        )


def test_bending_sees_a_penumbra_that_begins_beside_the_middles():
    """A parabola from x = 9 on: in squares whose middles it leaves out, there is no Hessian."""

    def shade(p):
        d = np.maximum(p[:, 0] - 9.0, 0.0)
        H = np.zeros((len(p), 2, 2))
        H[:, 0, 0] = 2.0 * (d > 0.0)
        return ShadedSamples(d**2, np.stack([2.0 * d, 0.0 * d], -1), H)

    # 4 x 4 squares of 8 pixels with their middles at 4, 12, 20 and 28
    first = seen(shade, by_hessian_differences, 16)[0]
    bending, hessian = (
        f(first).reshape(4, 4)[:, 0] / 8.0**3 for f in (by_hessian_differences, by_hessian)
    )
    np.testing.assert_allclose(hessian, [0.0, 2.0, 2.0, 2.0])
    # differences of the slopes 0, 6, 22 and 38: one-sided, over two squares, ...
    np.testing.assert_allclose(bending, [6.0 / 8, 22.0 / 16, 2.0, 2.0])


def test_tangent_planes_miss_a_quadratic_by_its_hessian():
    """Siblings h apart: differences less the gradient are H times half a step, of length h."""
    for squares in seen(quadratic, by_tangent_planes)[1:]:
        h = squares.size
        missed = by_tangent_planes(squares) - np.linalg.norm(H) * h**3
        # along each axis the neighbour stands on one side or the other: half a column of H
        sides = [0.5 * np.hypot(*(H[0, 0] * s, H[1, 1] * t)) for s in (-1, 1) for t in (-1, 1)]
        np.testing.assert_allclose(missed, h**3 * sides[0])
        assert np.allclose(sides, sides[0])


def test_tangent_planes_see_a_step_between_flat_squares():
    """Dark on the left and lit on the right: no gradient and no Hessian knows of it."""

    def step(p):
        return ShadedSamples(1.0 * (p[:, 0] > 16.0), np.zeros_like(p))

    first = seen(step, by_tangent_planes, 16)[0]
    assert np.all(by_hessian_differences(first) == 0.0)
    split = by_tangent_planes(first).reshape(4, 4)
    assert np.all(split[1:3] > 0.0)
    assert np.all(split[[0, 3]] == 0.0)


def test_tangent_planes_need_gradients():
    with pytest.raises(ValueError, match="needs gradients, but `shade` returns none"):
        sample_image(lambda p: ShadedSamples(p[:, 0]), 16, 16, 40, by_tangent_planes)


def test_on_a_plane_variance_is_differences_squared():
    """Four squares h apart: V = |g|^2 h^2 / 3, so that both metrics split alike, at all levels."""

    def plane(p):
        return ShadedSamples(p @ G, np.broadcast_to(G, p.shape))

    for squares in seen(plane, by_variance):
        np.testing.assert_allclose(3.0 * by_variance(squares), by_differences(squares) ** 2)


def test_one_split_notices_another_power_of_the_side(monkeypatch):
    assert derived.one_split() < 1e-12
    own = by_gradient
    monkeypatch.setattr(derived, "by_gradient", lambda squares: own(squares) * squares.size)
    assert derived.one_split() > 0.1


def test_variance_of_the_first_grid_is_of_fours_as_at_all_levels():
    """The mean of those of which a square is one: four inside, one in a corner of the image."""
    first = seen(quadratic, by_variance, 16)[0]
    V = quadratic(4.0 + 8.0 * np.argwhere(np.ones((4, 4)))).value.reshape(4, 4)
    found = first.variance.reshape(4, 4)
    fours = [V[i : i + 2, j : j + 2] for i in (0, 1) for j in (1, 2)]
    np.testing.assert_allclose(found[1, 2], np.mean([np.var(f, ddof=1) for f in fours]))
    np.testing.assert_allclose(found[3, 0], np.var(V[2:, :2], ddof=1))


@pytest.mark.parametrize(("height", "expected"), [(16, 0.5 * (8.0 * G[1]) ** 2), (8, 0.0)])
def test_a_first_grid_of_one_row_has_a_variance(height, expected):
    kept = []

    def asked(squares):
        kept.append(squares.variance)
        return by_variance(squares)

    sample_image(lambda p: ShadedSamples(p @ G), 8, height, height // 8, asked)
    np.testing.assert_allclose(kept[0], np.full(height // 8, expected))


def test_metrics_say_what_they_miss():
    bare = QuadtreeCells(np.ones(2), ShadedSamples(np.ones(2)), np.zeros((2, 2)))
    with pytest.raises(ValueError, match="needs gradients, but `shade` returns none"):
        by_hessian_differences(bare)
    with pytest.raises(ValueError, match="needs variances of neighbours"):
        by_variance(bare)


def test_the_product_knows_bumps_views_gloss_and_near_lamps():
    plain = dict(turning=np.ones((1, 2)), share=np.full((1, 2), 0.5), band=np.full((1, 2), 2.0),
                 distance=np.ones(1), cosine=np.ones(1), lamp=np.full(1, 3.0))  # fmt: skip
    least = importance_product(**plain)
    more = {"turning": 5.0, "band": 10.0, "distance": 2.0, "share": 2.0}
    for name, factor in more.items():
        assert importance_product(**plain | {name: factor * plain[name]}) > least
    for name in ("cosine", "lamp"):
        assert importance_product(**plain | {name: 0.5 * plain[name]}) > least


def test_far_light_loses_no_more_than_its_share():
    """Of a gradient SV + CDV: worst where they point against each other."""
    rng = np.random.default_rng(0)
    SV, CDV = rng.normal(size=(2, 5000, 2)) * np.exp(rng.normal(size=(2, 5000, 1)) * 2.0)
    for threshold in (1.5, 4.0, 20.0):
        far = is_far_light(*(np.linalg.norm(a, axis=1) for a in (CDV, SV)), threshold)
        lost = np.linalg.norm(SV, axis=1) / np.linalg.norm(SV + CDV, axis=1)
        assert 0.0 < lost[far].max() <= 1.0 / (threshold - 1.0)
        assert lost[~far].max() > 1.0 / (threshold - 1.0)
    with pytest.raises(ValueError, match=r"`threshold` must be at least 1, but is 0\.5"):
        is_far_light(np.ones(1), np.ones(1), 0.5)


FACTORS = {name: np.ones((4, 2)) for name in ("turning", "share", "band")}
FACTORS |= {name: np.ones(4) for name in ("distance", "cosine", "lamp")}


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"distance": np.ones((4, 1))}, r"`distance` must have shape \(4,\)"),
        ({"cosine": np.ones(3)}, r"`cosine` must have shape \(4,\)"),
        ({"share": np.ones((4, 1))}, r"`share` must have shape \(4, 2\)"),
        ({"band": np.full((4, 2), -1.0)}, "`band` must not be negative, but is -1"),
        ({"turning": np.full((4, 2), 1j)}, "`turning` must be real"),
        ({"lamp": np.zeros(4)}, "`lamp` must be positive, but is 0"),
    ],
)
def test_factors_belong_to_their_places(given, words):
    with pytest.raises((TypeError, ValueError), match=f"^Argument {words}|type hint"):
        importance_product(**FACTORS | given)


def test_where_nothing_is_seen_there_is_no_importance_to_refuse():
    nowhere = FACTORS | {"distance": np.array([1.0, np.inf, np.nan, 1.0])}
    assert np.isfinite(importance_product(**nowhere)).tolist() == [True, False, False, True]
