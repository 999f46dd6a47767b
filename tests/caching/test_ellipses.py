import jax
import jax.numpy as jnp
import numpy as np
import pytest

from derivations.caching._forms import integrated, matrices
from derivations.caching._third import cubic_by_sums, growth_of_a_cubic
from firstorder import caching
from firstorder.caching import (
    circular_regions,
    elliptic_regions,
    expected_error,
    geometric_bound,
    hessian_norm,
    largest_radiance,
    radius_for,
    semi_axes,
    surface_expected_error,
    third_derivative_norm,
)
from firstorder.caching import ellipses as space_radii
from firstorder.caching.ellipses import _positive_part, _principal

# Random ones of all signs, and the degenerate: round, flat one way, balanced, zero.
ODD = [np.eye(2), -3.0 * np.eye(2), np.diag([0.0, 2.0]), np.diag([1.0, -1.0]), np.zeros((2, 2))]
H = jnp.asarray(np.concatenate([matrices(19), ODD]))
ANGLE = np.pi * (np.arange(2000) + 0.5) / 2000
AROUND = np.stack([np.cos(ANGLE), np.sin(ANGLE)])
FORM = np.einsum("an,kab,bn->kn", AROUND, np.asarray(H), AROUND)


@pytest.fixture(scope="module")
def found():
    """Everything at a tolerance of 0.01, compiled once."""

    @jax.jit
    def everything(H):
        return {
            "principal": _principal(H),
            "mean": hessian_norm(H, "mean"),
            "largest": hessian_norm(H),
            "corrected": elliptic_regions(H, 0.01, 1e-6, 1e6, most=1e3),
            "printed": elliptic_regions(H, 0.01, 1e-6, 1e6, printed=True),
            "limited": semi_axes(H, 0.01, most=2.0)[0],
        }

    return everything(H)


def test_axes_are_eigenvectors(found):
    values, axes = (np.asarray(a) for a in found["principal"])
    rebuilt = (axes * values[:, None, :]) @ np.swapaxes(axes, 1, 2)
    np.testing.assert_allclose(rebuilt, H, atol=1e-13 * np.abs(H).max())
    np.testing.assert_allclose(np.swapaxes(axes, 1, 2) @ axes, np.eye(2) + 0 * rebuilt, atol=1e-14)
    assert np.all(np.abs(values[:, 0]) >= np.abs(values[:, 1]))


def test_the_mean_curvature_is_the_mean_and_the_largest_a_bound(found):
    mean = np.mean(np.abs(FORM), axis=1)
    np.testing.assert_allclose(found["mean"], mean, rtol=2e-6, atol=1e-12)
    np.testing.assert_allclose(found["largest"], np.abs(FORM).max(axis=1), rtol=3e-6)
    assert np.all(found["mean"] <= np.asarray(found["largest"]) * (1 + 1e-12))
    assert np.all(found["mean"] >= 0.4705 * np.asarray(found["largest"]))


def curved(H):
    """The corrected ellipses, where the Hessian has two axes."""
    return np.linalg.norm(np.asarray(H), axis=(1, 2)) > 0, np.abs(np.linalg.det(H)) > 1e-3


def test_an_ellipse_has_the_tolerated_error_and_the_printed_one_has_more(found):
    _, both = curved(H)
    values = np.abs(np.asarray(found["principal"][0])[both])
    ours, printed = (np.asarray(found[k].matrix)[both] for k in ("corrected", "printed"))
    error = [integrated(h, M) for h, M in zip(np.asarray(H)[both], ours, strict=True)]
    np.testing.assert_allclose(error, 0.01, rtol=1e-3)
    flat = [np.diag([a, b]) for a, b in values]
    # The print integrates moduli of the eigenvalues: in their own frame, as circles of its axes.
    sizes = [np.diag(np.linalg.svd(M)[1]) for M in printed]
    error = [integrated(h, M) for h, M in zip(flat, sizes, strict=True)]
    q = (values[:, 0] / values[:, 1]) ** 0.25
    np.testing.assert_allclose(error, 0.005 * (q + 1.0 / q), rtol=1e-10)
    definite = np.linalg.det(np.asarray(H)[both]) > 0
    np.testing.assert_allclose(
        np.linalg.det(ours)[definite], np.linalg.det(printed)[definite], rtol=1e-10
    )
    np.testing.assert_allclose(
        np.linalg.det(ours)[~definite] * np.sqrt(np.pi / 2),
        np.linalg.det(printed)[~definite],
        rtol=1e-10,
    )


def largest_of_all(h, tolerance, window, cells=700):
    """Area of the largest set of equal error within a window, by sorting cells."""
    x = window * (2.0 * (np.arange(cells) + 0.5) / cells - 1.0)
    form = np.abs(h[0, 0] * x[:, None] ** 2 + 2 * h[0, 1] * x[:, None] * x + h[1, 1] * x**2)
    cell = (2.0 * window / cells) ** 2
    sums = np.cumsum(np.sort(0.5 * form.ravel())) * cell
    return np.searchsorted(sums, tolerance) * cell


def test_a_definite_hessians_ellipse_is_the_largest_of_all_sets_and_a_saddle_has_none(found):
    definite = np.array([[3.0, 1.0], [1.0, 1.0]])
    lengths = jax.jit(lambda H: semi_axes(H, 0.01)[0])(jnp.asarray(definite)[None])
    area = np.pi * float(jnp.prod(lengths))
    best = largest_of_all(definite, 0.01, 2.0 * float(lengths[0, 1]))
    np.testing.assert_allclose(best, area, rtol=5e-3)
    disc = np.pi * float(radius_for(hessian_norm(jnp.asarray(definite)), 0.01, dims=2)) ** 2
    assert disc < 0.65 * area  # what (70) leaves
    areas = [largest_of_all(np.diag([1.0, -1.0]), 0.01, w) for w in (1.0, 2.0, 4.0, 8.0)]
    assert np.all(np.diff(areas) > 0.05 * areas[0])


@pytest.mark.smoke
def test_limits_act_and_are_said(found):
    lengths = np.asarray(found["limited"])
    some, _ = curved(H)
    assert np.all(lengths[some, 1] <= 2.0 * lengths[some, 0] * (1 + 1e-12))
    reach = jax.jit(lambda H: elliptic_regions(H, 0.01, 0.2, 0.4))(H)
    sizes = 1.0 / np.linalg.svd(np.asarray(reach.matrix))[1]
    assert np.all((sizes > 0.2 - 1e-12) & (sizes < 0.4 + 1e-12))
    np.testing.assert_allclose(reach.matrix[-1], np.eye(2) / 0.4)
    assert reach.clamp[-1] == 1
    assert set(np.asarray(reach.clamp).tolist()) == {-1, 0, 1}


def test_a_limited_ellipse_still_has_the_tolerated_error(found):
    some, _ = curved(H)
    _, axes = found["principal"]
    lengths = found["limited"]
    for i in np.flatnonzero(some):
        M = np.diag(1.0 / np.asarray(lengths[i])) @ np.asarray(axes[i]).T
        np.testing.assert_allclose(integrated(np.asarray(H[i]), M), 0.01, rtol=2e-3)


def test_expected_errors_on_discs_are_integrals(found):
    """Six definitions on a surface, for the quadratic of unit curvature, in closed form."""
    R, h = 0.7, 2.3
    miss = [0.5 * h * R**2, 0.125 * h**2 * R**4 / 1.5]
    area = np.pi * R * R
    true = {
        "total": 0.25 * np.pi * h * R**4,
        "average": 0.25 * np.pi * h * R**4 / area,
        "integrated squared": miss[1] * area * 2 / 2,
        "average squared": miss[1],
        "largest": miss[0],
        "relative": 0.25 * np.pi * h * R**4 / 1.7,
    }
    for definition, value in true.items():
        options = {"definition": definition, "value": 1.7, "dims": 2}
        assert expected_error(h, R, **options).item() == pytest.approx(value, rel=1e-12)
        assert radius_for(h, value, **options).item() == pytest.approx(R, rel=1e-12)


WRONG = {
    "a square root lost": ("hessian_norm", lambda H, kind="largest": hessian_norm(H) * 0 + 1.0),
    "the largest for the mean": ("hessian_norm", lambda H, kind="largest": hessian_norm(H)),
    "axes in rows": (
        "_principal",
        lambda H: (_principal(H)[0], jnp.swapaxes(_principal(H)[1], -1, -2)),
    ),
}


@pytest.mark.parametrize("fault", WRONG)
def test_a_fault_is_noticed_by_the_error_of_the_ellipse(fault, monkeypatch):
    h = np.asarray(H)[:4]

    def made():
        return np.asarray(
            jax.jit(lambda h: elliptic_regions(h, 0.01, 1e-6, 1e6, most=1e3))(h).matrix
        )

    good = made()
    name, wrong = WRONG[fault]
    monkeypatch.setattr(space_radii, name, wrong)
    bad = made()
    errors = [
        max(abs(integrated(a, M) / 0.01 - 1.0) for a, M in zip(h, every, strict=True))
        for every in (good, bad)
    ]
    assert errors[0] < 1e-3 < 1e-2 < errors[1] < np.inf


def test_third_derivatives_count_by_their_mean():
    rng = np.random.default_rng(0)
    T = rng.normal(size=(2, 2, 2))
    T = sum(np.transpose(T, p) for p in ((0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1)))
    dense = np.mean(np.abs(np.einsum("abc,an,bn,cn->n", T, AROUND, AROUND, AROUND)))
    assert third_derivative_norm(jnp.asarray(T)).item() == pytest.approx(dense, rel=2e-3)


WRONG_MEANS = {
    "a factor": lambda T: 1.1 * third_derivative_norm(T),
    "no modulus": lambda T: jnp.abs(T[..., 0, 0, 0] + T[..., 0, 1, 1]),
}


@pytest.mark.parametrize("fault", WRONG_MEANS)
def test_a_wrong_mean_of_third_derivatives_is_seen(fault, monkeypatch):
    assert cubic_by_sums() < 2e-3
    assert growth_of_a_cubic() < 2e-3
    monkeypatch.setattr(caching, "third_derivative_norm", WRONG_MEANS[fault])
    assert cubic_by_sums() > 0.02
    assert growth_of_a_cubic() > 0.02


def test_no_light_beats_the_geometric_bound():
    """Random pieces of geometry, random light on them, and its worst in every direction."""
    rng = np.random.default_rng(5)
    pieces = matrices(24, 9)
    weights = rng.uniform(0.1, 1.0, 24)
    B = np.asarray(jax.jit(geometric_bound)(jnp.asarray(pieces), jnp.asarray(weights)))
    light = rng.uniform(size=(400, 24)) ** rng.uniform(0.1, 5.0, (400, 1))
    sums = np.einsum("lk,k,kab->lab", light, weights, pieces)
    reached = np.abs(np.einsum("an,lab,bn->ln", AROUND, sums, AROUND))
    bound = np.einsum("an,ab,bn->n", AROUND, B, AROUND)
    assert np.max(reached / bound) < 1.0
    # And the bound is no more than twice the worst light.
    form = np.einsum("an,kab,bn->kn", AROUND, pieces * weights[:, None, None], AROUND)
    worst = np.maximum(np.maximum(form, 0).sum(0), np.maximum(-form, 0).sum(0))
    assert np.all(worst <= bound * (1 + 1e-12))
    assert np.max(bound / worst) < 2.0
    # The printed Hessian, all light alike, is exceeded by light where the pieces curve one way.
    even = np.abs(np.linalg.eigvalsh(np.einsum("k,kab->ab", weights, pieces))).max()
    assert np.max(worst) > 1.1 * even


def test_positive_parts_add_up():
    parts = jax.jit(lambda H: (_positive_part(H), _positive_part(-H)))(H)
    up, down = (np.asarray(p) for p in parts)
    np.testing.assert_allclose(up - down, H, atol=1e-12)
    assert np.linalg.eigvalsh(up).min() > -1e-12
    np.testing.assert_allclose(up @ down, 0.0, atol=1e-9)


@pytest.mark.smoke
def test_the_largest_radiance():
    assert largest_radiance(np.array([[1.0, 3.0], [2.0, 0.0]])).item() == 3.0
    assert largest_radiance(jnp.arange(101.0), 0.5).item() == 50.0


@pytest.mark.smoke
@pytest.mark.parametrize(
    ("call", "words"),
    [
        (
            lambda: hessian_norm(H, "least"),
            r"^Argument `kind` must be one of \['largest', 'mean'\]",
        ),
        (lambda: semi_axes(H, 0.1, most=0.5), r"^Argument `most` must be at least 1, but is 0.5.$"),
        (
            lambda: semi_axes(H, 0.1, definition="average", printed=True),
            r"^Argument `definition` must be 'total' for the printed axes, but is 'average'.$",
        ),
        (
            lambda: circular_regions(jnp.ones(2), -1.0, 1.0),
            r"^Argument `low` must be positive, but is -1",
        ),
        (lambda: radius_for(1.0, 1.0, dims=3), r"^Argument `dims` must be 1 or 2, but is 3.$"),
        (lambda: largest_radiance(np.array([-1.0])), r"^Argument `radiances` must not be negative"),
        (lambda: largest_radiance(1.0, 0.0), r"^Argument `quantile` must lie in \(0, 1\], but is"),
    ],
)
def test_bad_input_is_one_sentence(call, words):
    with pytest.raises(ValueError, match=words):
        call()


def test_the_estimate_is_what_the_sums_are():
    M = jnp.asarray(np.eye(2) + 0.3 * np.random.default_rng(2).normal(size=(24, 2, 2)))
    ours = np.asarray(jax.jit(surface_expected_error)(H, M))
    true = [integrated(h, m, 2000) for h, m in zip(np.asarray(H), np.asarray(M), strict=True)]
    np.testing.assert_allclose(ours, true, rtol=1e-5, atol=1e-12)
