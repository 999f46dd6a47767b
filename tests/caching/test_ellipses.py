import jax
import jax.numpy as jnp
import numpy as np
import pytest

from derivations.caching._forms import integrated, matrices
from firstorder.caching import (
    DEFINITIONS,
    derivative_norm,
    ellipses,
    elliptic_regions,
    expected_error,
    geometric_bound,
    gradient_regions,
    radius_for,
    semi_axes,
)
from firstorder.caching.ellipses import _principal

# Random ones of all signs, and the degenerate: round, flat one way, balanced, zero.
ODD = [np.eye(2), -3.0 * np.eye(2), np.diag([0.0, 2.0]), np.diag([1.0, -1.0]), np.zeros((2, 2))]
H = jnp.asarray(np.concatenate([matrices(19), ODD]))


@pytest.fixture(scope="module")
def found():
    """Everything at a tolerance of 0.01, compiled once."""

    @jax.jit
    def everything(H):
        return {
            "principal": _principal(H),
            "corrected": elliptic_regions(H, 0.01, 1e-6, 1e6, most=1e3),
            "printed": elliptic_regions(H, 0.01, 1e-6, 1e6, printed=True),
            "limited": semi_axes(H, 0.01, most=2.0),
        }

    return everything(H)


def test_axes_are_eigenvectors(found):
    values, axes = (np.asarray(a) for a in found["principal"])
    rebuilt = (axes * values[:, None, :]) @ np.swapaxes(axes, 1, 2)
    np.testing.assert_allclose(rebuilt, H, rtol=0.0, atol=1e-13 * np.abs(H).max())
    np.testing.assert_allclose(
        np.swapaxes(axes, 1, 2) @ axes, np.eye(2) + 0 * rebuilt, rtol=0.0, atol=1e-14
    )
    assert np.all(values[:, 0] >= values[:, 1])


def curved(H):
    """The corrected ellipses, where the Hessian has two axes."""
    return np.linalg.norm(np.asarray(H), axis=(1, 2)) > 0, np.abs(np.linalg.det(H)) > 1e-3


def test_an_ellipse_has_the_tolerated_error_and_the_printed_one_has_more(found):
    _, both = curved(H)
    values = -np.sort(-np.abs(np.asarray(found["principal"][0])[both]), axis=1)
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
    disc = np.pi * float(radius_for(derivative_norm(jnp.asarray(definite), 2), 0.01, dims=2)) ** 2
    assert disc < 0.65 * area  # what (70) leaves
    areas = [largest_of_all(np.diag([1.0, -1.0]), 0.01, w) for w in (1.0, 2.0, 4.0, 8.0)]
    assert np.all(np.diff(areas) > 0.05 * areas[0])


@pytest.mark.smoke
def test_limits_act_and_are_said(found):
    lengths = np.asarray(found["limited"][0])
    some, _ = curved(H)
    assert np.all(lengths[:, 0] <= lengths[:, 1])
    assert np.all(lengths[some, 1] <= 2.0 * lengths[some, 0] * (1 + 1e-12))
    reach = jax.jit(lambda H: elliptic_regions(H, 0.01, 0.2, 0.4))(H)
    sizes = 1.0 / np.linalg.svd(np.asarray(reach.matrix))[1]
    assert np.all((sizes > 0.2 - 1e-12) & (sizes < 0.4 + 1e-12))
    np.testing.assert_allclose(reach.matrix[-1], np.eye(2) / 0.4)
    assert reach.clamp[-1] == 1
    assert set(np.asarray(reach.clamp).tolist()) == {-1, 0, 1}


def test_a_limited_ellipse_still_has_the_tolerated_error(found):
    some, _ = curved(H)
    lengths, axes = found["limited"]
    for i in np.flatnonzero(some):
        M = np.diag(1.0 / np.asarray(lengths[i])) @ np.asarray(axes[i]).T
        np.testing.assert_allclose(integrated(np.asarray(H[i]), M), 0.01, rtol=2e-3)


@pytest.mark.parametrize("size", [[1.0, -1.0], [1.0, 0.0], [1.0, 1.0], [3.0, -2.0]])
def test_ellipses_turn_with_their_hessians_and_shrink(size):
    """Which axis of a saddle is the shorter one is rounding, and once was decided twice."""
    rng = np.random.default_rng(0)
    angles, k = jnp.asarray(rng.uniform(0.0, 6.0, 500)), jnp.asarray(rng.normal(size=500))

    def matrix(angle, k):
        c, s = jnp.cos(angle), jnp.sin(angle)
        turn = jnp.stack([jnp.stack([c, -s]), jnp.stack([s, c])])
        H = k * (turn @ jnp.diag(jnp.array(size)) @ turn.T)
        return elliptic_regions(H, 0.01, 1e-3, 1e3, most=4.0).matrix

    M = np.asarray(jax.jit(jax.vmap(matrix))(angles, k))
    turned, scaled = jax.jit(jax.vmap(jax.jacfwd(matrix, (0, 1))))(angles, k)
    J = np.array([[0.0, -1.0], [1.0, 0.0]])
    np.testing.assert_allclose(turned, J @ M - M @ J, rtol=0.0, atol=1e-12 * np.max(M))
    wanted = 0.25 * M / np.asarray(k)[:, None, None]
    np.testing.assert_allclose(scaled, wanted, rtol=1e-11, atol=1e-12)


def by_cells(h, M, definition):
    """Error of an ellipse by its definition, from cells of its disc, for E = 2 at the record."""
    r = (np.arange(400) + 0.5) / 400
    phi = 2.0 * np.pi * (np.arange(800) + 0.5) / 800
    y = r[:, None, None] * np.stack([np.cos(phi), np.sin(phi)], -1)
    x = y @ np.linalg.inv(M).T
    miss = 0.5 * np.abs(np.einsum("rpa,ab,rpb->rp", x, h, x))
    weight = np.broadcast_to(2.0 * np.pi / 400 / 800 * r[:, None], miss.shape)
    power = 2 if "squared" in definition else 1
    total = np.sum(weight * miss**power) / np.linalg.det(M)
    area = np.sum(weight) / np.linalg.det(M)
    if definition == "largest":
        return np.max(miss)
    if definition == "relative":
        return total / 2.0
    return total / area if definition.startswith("average") else total


@pytest.mark.parametrize("definition", DEFINITIONS)
@pytest.mark.parametrize("most", [1e3, 1.5])
def test_an_ellipse_has_the_tolerated_error_by_every_definition(definition, most):
    """One norm for all of them once let the largest error of a saddle be 1.57 times as large."""
    signs = np.array(
        [[[3.0, 0.5], [0.5, -1.0]], [[2.0, 0.7], [0.7, 5.0]], [[0.0, 1.0], [1.0, 0.0]]]
    )
    found = semi_axes(signs, 0.01, definition=definition, value=2.0, most=most)
    for h, size, turned in zip(signs, *map(np.asarray, found), strict=True):
        M = np.diag(1.0 / size) @ turned.T
        np.testing.assert_allclose(by_cells(h, M, definition), 0.01, rtol=5e-3)


WRONG = {
    "a square root lost": ("derivative_norm", lambda H, q, kind: derivative_norm(H, q) * 0 + 1.0),
    "the largest for the mean": ("derivative_norm", lambda H, q, kind: derivative_norm(H, q)),
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
    monkeypatch.setattr(ellipses, name, wrong)
    bad = made()
    errors = [
        max(abs(integrated(a, M) / 0.01 - 1.0) for a, M in zip(h, every, strict=True))
        for every in (good, bad)
    ]
    assert errors[0] < 1e-3 < 1e-2 < errors[1] < np.inf


@pytest.mark.smoke
@pytest.mark.parametrize(
    ("call", "words"),
    [
        (
            lambda: semi_axes(jnp.ones((3, 1, 1)), 0.1),
            r"^Argument `H` must have shape \(..., 2, 2\), but has \(3, 1, 1\): a line has no ell",
        ),
        (
            lambda: semi_axes(H, 0.1, most=0.5),
            r"`most` must be at least 1 and finite, but is 0.5.$",
        ),
        (
            lambda: elliptic_regions(jnp.diag(jnp.array([1.0, 0.0])), 0.1, 0.1, 1.0, most=np.inf),
            r"^Argument `most` must be at least 1 and finite, but is inf.$",
        ),
        (
            lambda: gradient_regions(jnp.ones(2), np.inf, 0.1, 1.0, ratio=np.inf),
            r"^Argument `ratio` must be at least 1 and finite, but is inf.$",
        ),
        *(
            (
                lambda d=d: gradient_regions(jnp.ones((4, d)), 0.5, 0.1, 1.0),
                rf"^Argument `gradient` must have shape \(..., 2\), but has \(4, {d}\)",
            )
            for d in (1, 3)
        ),
        (
            lambda: gradient_regions(jnp.ones((4, 2)), np.ones(3), 0.1, 1.0),
            r"^Argument `radius` must broadcast to shape \(4,\), but has \(3,\).$",
        ),
        (
            lambda: semi_axes(H, 0.1, definition="average", printed=True),
            r"^Argument `definition` must be 'total' for the printed axes, but is 'average'.$",
        ),
        (
            lambda: elliptic_regions(H, 0.1, -1.0, 1.0),
            r"^Argument `low` must be positive, but is -1",
        ),
    ],
)
def test_bad_input_is_one_sentence(call, words):
    with pytest.raises(ValueError, match=words):
        call()


# --- along the gradient --------------------------------------------------------------------------


def test_the_shorter_axis_lies_along_the_gradient():
    angle = np.linspace(0.1, 6.0, 7)
    g = 3.0 * jnp.stack([jnp.cos(angle), jnp.sin(angle)], -1)
    region = gradient_regions(g, jnp.linspace(0.2, 0.8, 7), 0.01, 10.0, ratio=4.0)
    lengths, longer = region.axes()
    np.testing.assert_allclose(lengths[:, 0], np.linspace(0.2, 0.8, 7))
    np.testing.assert_allclose(lengths[:, 1], np.linspace(0.05, 0.2, 7))
    np.testing.assert_allclose(np.cos(longer - angle), 0.0, rtol=0.0, atol=1e-12)


def test_without_a_gradient_the_region_is_a_disc():
    region = gradient_regions(jnp.zeros((1, 2)), jnp.inf, 0.01, 2.0, ratio=4.0)
    assert region.matrix.tolist() == [[[0.5, 0.0], [0.0, 0.5]]]
    slope = jax.jacfwd(lambda g: gradient_regions(g, 0.5, 0.01, 2.0).matrix)(jnp.zeros(2))
    assert np.all(np.isfinite(slope))


def test_limits_hold_each_axis():
    region = gradient_regions(jnp.array([[1.0, 0.0]]), 0.4, 0.2, 0.3, ratio=4.0)
    np.testing.assert_allclose(region.axes()[0], [[0.3, 0.2]])
    assert region.clamp.tolist() == [-1]


@pytest.mark.parametrize("across", [False, True])
def test_the_hessian_knows_the_eccentricity_that_a_user_guesses(across):
    """At equal area the guess errs more, and most where light bends across the gradient."""
    bend = jnp.diag(jnp.array([1.0, 16.0] if across else [16.0, 1.0]))
    best = elliptic_regions(bend, 0.01, 1e-6, 1e6)
    guess = gradient_regions(jnp.array([1.0, 0.0]), 1.0, 1e-6, 1e6, ratio=2.0)
    same = ellipses.ValidityRegion(guess.matrix * guess.radius / best.radius)
    more = expected_error(bend, same) / expected_error(bend, best)
    # Axes (a, b) of equal area: the mean of 16 x^2 + y^2 over the ellipse is 10 or 32.5 to 8.
    assert abs(more - ((1.0 / 2.0 * 1.0 + 2.0 * 16.0) / 8.0 if across else 10.0 / 8.0)) < 1e-6


def test_a_ratio_below_one_is_refused():
    with pytest.raises(ValueError, match="`ratio` must be at least 1"):
        gradient_regions(jnp.ones(2), 1.0, 0.1, 1.0, ratio=0.5)


def test_a_gradient_that_is_no_number_gives_no_disc():
    found = gradient_regions(np.array([np.nan, 0.0]), 0.5, 0.01, 1.0)
    assert np.all(np.isnan(found.matrix))


@pytest.mark.parametrize(
    ("precision", "size"),
    [("float32", 1e-20), ("float32", 1e20), ("float64", 1e-200), ("float64", 1e200)],
)
def test_derivatives_of_regions_are_finite_and_right_in_every_unit_of_light(precision, size):
    """Squares of Hessians left the range of the precision: slopes were NaN, or lacked terms."""
    H = jnp.array([[3.0, 0.7], [0.7, -1.0]], precision)

    def free(H, unit):
        lengths, axes = semi_axes(H, 0.1 * unit, definition="average")
        return jnp.sum(lengths * axes[0])

    def held(H):
        return jnp.sum(elliptic_regions(H, 0.1, 1e-3, 100.0).matrix)

    def bound(H):
        return jnp.sum(geometric_bound(jnp.stack([H, -2.0 * H])))

    def along(g):
        return jnp.sum(gradient_regions(g, 0.5, 0.01, 1.0).matrix)

    size = jnp.asarray(size, precision)
    unit = jax.jit(jax.grad(free))(H, jnp.ones((), precision))
    np.testing.assert_allclose(size * jax.jit(jax.grad(free))(size * H, size), unit, rtol=1e-4)
    for scale_free in (bound, lambda H: derivative_norm(H, 2, "mean")):
        slope = jax.jit(jax.grad(scale_free))
        np.testing.assert_allclose(slope(size * H), slope(H), rtol=1e-4)
    turn = jax.jit(jax.grad(along))
    np.testing.assert_allclose(size * turn(size * H[0]), turn(H[0]), rtol=1e-4)
    for slope in (jax.grad(held), jax.jacfwd(held)):
        assert np.all(np.isfinite(jax.jit(slope)(size * H)))
