"""Interpolation over a grid: what it reproduces, its order, its edges, and what notices faults."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpy.polynomial import polynomial as poly

from firstorder import reconstruction
from firstorder.checks.tolerance import fitted_order, normwise, rounding
from firstorder.reconstruction import GridInterpolant
from firstorder.reconstruction import grid as surfaces
from firstorder.reconstruction.grid import SCHEMES

X, Y = np.array([-1.0, -0.6, 0.1, 0.3, 1.2]), np.array([0.0, 0.5, 0.8, 2.0])  # uneven
S, T = (a.ravel() for a in np.meshgrid(np.linspace(-1, 1.2, 23), np.linspace(0, 2, 21)))
GIVEN = "hermite, twist given"  # the same with a fourth column


def everything(x, y, data, s, t, labels=None, label=None):
    """All schemes at once: one program for all tests that fill their points up to one number."""
    labels = None if labels is None else jnp.asarray(labels)
    out = {
        scheme: GridInterpolant(x, y, data[..., : about.data], scheme, labels)(s, t, label)
        for scheme, about in SCHEMES.items()
    }
    return out | {GIVEN: GridInterpolant(x, y, data, "hermite", labels)(s, t, label)}


compiled = jax.jit(everything)


def at_places(data, s, t, x=X, y=Y):
    """The compiled program at any number of points, up to that of S."""
    s, t = np.broadcast_arrays(s, t)
    filled = [np.concatenate([a.ravel(), np.full(S.size - a.size, a.ravel()[0])]) for a in (s, t)]
    found = compiled(x, y, data, *filled)
    return {k: np.asarray(v)[: s.size].reshape(s.shape) for k, v in found.items()}


def part(c, k, m, x, y):
    return poly.polyval2d(x, y, poly.polyder(poly.polyder(c, k, axis=0), m, axis=1))


def columns(c, x=X, y=Y):
    x, y = np.meshgrid(x, y, indexing="ij")
    wanted = ((0, 0), (1, 0), (0, 1), (1, 1))
    return np.stack([part(c, k, m, x, y) + 0.0 * x for k, m in wanted], -1)


def monomials(kept):
    """Random coefficients of the monomials x^i y^j, i and j up to 4, that are kept."""
    c = np.random.default_rng(5).normal(size=(5, 5))
    return c * np.array([[kept(i, j) for j in range(5)] for i in range(5)])


def error(scheme, c):
    return normwise(at_places(columns(c), S, T)[scheme], part(c, 0, 0, S, T))


def degree(n):
    return lambda i, j: i + j <= n


# What each reproduces, and one monomial beyond it: on cells of any shape.
EXACT = {
    "bilinear": (lambda i, j: max(i, j) <= 1, (2, 0)),
    "bicubic": (lambda i, j: max(i, j) <= 2, (3, 0)),
    "hermite": (degree(3), (4, 0)),
    GIVEN: (lambda i, j: max(i, j) <= 3, (4, 0)),
    "hermite, no twist": (lambda i, j: min(i, j) == 0 and max(i, j) <= 3, (1, 1)),
    "serendipity": (lambda i, j: i + j <= 3 or (i, j) in ((3, 1), (1, 3)), (2, 2)),
    "bezier": (degree(2), (3, 0)),
    "extrapolated": (degree(1), (2, 0)),
    "inverse distance": (degree(1), (2, 0)),
}


@pytest.mark.smoke
@pytest.mark.parametrize("scheme", EXACT)
def test_polynomials_that_it_should_reproduce_and_one_that_it_cannot(scheme):
    kept, beyond = EXACT[scheme]
    assert error(scheme, monomials(kept)) < rounding(200)
    assert error(scheme, monomials(lambda i, j: (i, j) == beyond)) > 1e-3


def smooth(x, y):
    """A function with mixed derivatives of every order, and its first three derivatives."""
    a, b, c = 2.0 * x + 0.3, 1.7 * y, 2.0 * x * y
    f = np.sin(a) * np.cos(b) + 0.3 * np.sin(c)
    fx = 2.0 * np.cos(a) * np.cos(b) + 0.6 * y * np.cos(c)
    fy = -1.7 * np.sin(a) * np.sin(b) + 0.6 * x * np.cos(c)
    fxy = -3.4 * np.cos(a) * np.sin(b) + 0.6 * np.cos(c) - 1.2 * x * y * np.sin(c)
    return f, np.stack([f, fx, fy, fxy], -1)


@pytest.fixture(scope="module")
def errors():
    """Largest errors on grids about a few points, which shrink: the order is that of refinement."""
    found = []
    for h in (0.05, 0.025, 0.0125):
        worst = dict.fromkeys(EXACT, 0.0)
        for a, b in ((0.4, 0.6), (0.8, 0.2), (0.2, 1.0), (0.7, 0.9)):
            (x, y), (s, t) = (a + h * X, b + h * Y), (a + h * S, b + h * T)
            _, data = smooth(*np.meshgrid(x, y, indexing="ij"))
            truth, _ = smooth(s, t)
            for scheme, f in at_places(data, s, t, x, y).items():
                worst[scheme] = max(worst[scheme], float(np.max(np.abs(f - truth))))
        found.append(worst)
    return {k: [f[k] for f in found] for k in EXACT}


@pytest.mark.parametrize("scheme", EXACT)
def test_the_order_is_the_stated_one(errors, scheme):
    order = fitted_order([0.05, 0.025, 0.0125], errors[scheme])
    assert abs(order - SCHEMES["hermite" if scheme == GIVEN else scheme].order) < 0.25


def test_gradients_used_in_full_gain_nothing_on_bilinear(errors):
    """The leading errors are each other's negatives: f'' is over- and undershot alike."""
    assert abs(errors["extrapolated"][-1] / errors["bilinear"][-1] - 1.0) < 0.05
    found = at_places(columns(monomials(degree(4))), S, T)
    middle = 0.5 * (found["extrapolated"] + found["bilinear"])
    assert normwise(found["bezier"], middle) < rounding(50)


def test_slopes_agree_across_cells_where_it_says_so():
    data = np.random.default_rng(0).normal(size=(5, 4, 4))
    h = 1e-6
    x, y = np.meshgrid(X[2] + h * np.array([-2, -1, 0, 1, 2]), np.linspace(0.05, 1.95, 9))
    found = at_places(data, x, y)
    for scheme, f in found.items():
        slope = np.diff(np.asarray(f), axis=1) / h
        gap = normwise(slope[:, 1], slope[:, 2])
        smooth = SCHEMES["hermite" if scheme == GIVEN else scheme].smooth
        assert (gap < 1e-4) == smooth, scheme


def test_nodes_keep_their_values():
    data = np.random.default_rng(1).normal(size=(5, 4, 4))
    x, y = (a.ravel() for a in np.meshgrid(X, Y, indexing="ij"))
    for f in at_places(data, x, y).values():
        assert normwise(f, data[..., 0].ravel()) < 1e-10


def test_a_row_of_two_nodes_has_lines_for_slopes():
    f = jnp.array([[0.0], [2.0]])
    assert surfaces._slopes(jnp.array([0.0, 4.0]), f, None).tolist() == [[0.5], [0.5]]


# --- labels --------------------------------------------------------------------------------------


def world(x, y):
    """A ramp with a step at x = -0.2: label 0 to its left, 1 to its right."""
    right = x > -0.2
    f = np.where(right, 5.0 + x - y, x * y + y)
    slopes = np.where(right, 1.0, y), np.where(right, -1.0, x + 1.0), np.where(right, 0.0, 1.0)
    return np.stack([f, *slopes], -1), right.astype(int)


def test_nothing_is_interpolated_across_an_edge_in_the_image():
    data, labels = world(*np.meshgrid(X, Y, indexing="ij"))
    truth, seen = world(S, T)
    found = jax.jit(everything)(X, Y, data, S, T, labels, seen)
    blind = at_places(data, S, T)
    cut = (X[1] < S) & (X[2] > S)  # cells of both labels: planes at best, or constants
    for scheme, f in found.items():
        about = SCHEMES["hermite" if scheme == GIVEN else scheme]
        assert np.max(np.abs(blind[scheme] - truth[:, 0])) > 1.0
        off = np.abs(np.asarray(f) - truth[:, 0])
        assert np.max(off[cut]) < (1.5 if about.data == 1 else 0.3)
        assert np.max(off[cut & (seen == 1)]) < (1.5 if about.data == 1 else rounding(200))
        if about.order > 2:
            assert np.max(off[~cut]) < rounding(200)


def test_where_no_corner_has_the_label_nothing_is_known():
    grid = GridInterpolant(
        [0.0, 1.0], [0.0, 1.0], np.ones((2, 2, 3)), labels=jnp.zeros((2, 2), int)
    )
    half = np.array([0.5, 0.5])
    found = eqx.filter_jit(grid)(half, half, np.array([3, 0]))
    assert np.isnan(found).tolist() == [True, False]


@pytest.mark.parametrize("kind", [np.asarray, list, jnp.asarray])
def test_labels_of_any_kind_work_inside_compiled_code(kind):
    """`imaging.RenderedImage` has them in NumPy."""
    labels = kind([[0, 0], [1, 1]])
    grid = GridInterpolant([0.0, 1.0], [0.0, 1.0], np.ones((2, 2, 1)), "bilinear", labels)
    found = jax.jit(lambda x: grid(x, 0.5, 1))(0.75)
    assert found.item() == 1.0


def test_corners_of_a_label_are_extended_by_the_gradients_that_are_known():
    data = np.tile((0.0, 1.0, 0.0), (2, 2, 1))
    labels = jnp.asarray([[0, 0], [1, 1]])
    for known, wanted in ((3, 0.5), (1, 0.0)):
        grid = GridInterpolant([0.0, 1.0], [0.0, 1.0], data[..., :known], "bilinear", labels)
        np.testing.assert_allclose(grid(0.5, 0.5, 0), wanted, rtol=1e-12)


def test_slopes_do_not_reach_across_labels():
    """Values 0, 1, 2 | 90, 91, 92: lines on both sides, whatever the parabolas would have said."""
    f = jnp.asarray(np.repeat(np.array([0.0, 1.0, 2.0, 90.0, 91.0, 92.0])[:, None], 2, 1))
    slopes = jax.jit(surfaces._slopes)
    labels = jnp.asarray(np.repeat([0, 0, 0, 1, 1, 1], 2).reshape(6, 2))
    assert normwise(slopes(jnp.arange(6.0), f, labels), np.ones((6, 2))) == 0
    lone = jnp.asarray(np.repeat([0, 1, 0, 1, 1, 0], 2).reshape(6, 2))
    assert slopes(jnp.arange(6.0), f, lone)[:, 0].tolist() == [0.0, 0.0, 0.0, 1.0, 1.0, 0.0]


# --- faults --------------------------------------------------------------------------------------


def _no_lengths(self, x, y, label=None):
    x, y = jnp.asarray(x), jnp.asarray(y)
    i, j = surfaces.cell_of(self.x, x), surfaces.cell_of(self.y, y)
    s = (x - self.x[i]) / (self.x[i + 1] - self.x[i])
    t = (y - self.y[j]) / (self.y[j + 1] - self.y[j])
    at = i[..., None, None] + np.array([[0], [1]]), j[..., None, None] + np.array([[0, 1]])
    return surfaces._combined(self.scheme, s, t, self._completed()[at])


def _wrong(name, change):
    def fault(monkeypatch):
        right = getattr(surfaces, name)
        monkeypatch.setattr(surfaces, name, lambda *a: change(right, *a))

    return fault


FAULTS = {
    "lengths of cells are forgotten": lambda m: m.setattr(GridInterpolant, "__call__", _no_lengths),
    "the gradient's components are exchanged": _wrong(
        "_combined", lambda f, c, s, t, a: f(c, s, t, a[..., jnp.array([0, 2, 1, 3])])
    ),
    "offsets have the other sign": _wrong("_offsets", lambda f, s, t: tuple(-a for a in f(s, t))),
    "the whole gradient for its half": _wrong(
        "_extrapolated", lambda f, s, t, a, reach: f(s, t, a, 2.0 * reach)
    ),
    "bases of rows for columns": _wrong("_tensor", lambda f, across, up, a: f(up, across, a)),
    "no mixed derivative": _wrong("_slopes", lambda f, x, a, labels: 0.0 * f(x, a, labels)),
    "slopes by chords on one side": _wrong(
        "_slopes",
        lambda f, x, a, labels: jnp.asarray(jnp.gradient(a, axis=0)) / jnp.mean(jnp.diff(x)),
    ),
}
# Whom a fault concerns.
NOTICED = {
    "offsets have the other sign": ("bezier", "inverse distance"),
    "the whole gradient for its half": ("bezier",),
    "bases of rows for columns": ("bilinear", "hermite"),
    "no mixed derivative": ("bicubic", "hermite"),
    "slopes by chords on one side": ("bicubic", "hermite"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_wrong_formula_is_noticed(fault, monkeypatch):
    schemes = NOTICED.get(fault, ("hermite", "bezier"))
    cases = {scheme: monomials(EXACT[scheme][0]) for scheme in schemes}
    data = {k: columns(c)[..., : SCHEMES[k].data] for k, c in cases.items()}
    FAULTS[fault](monkeypatch)
    run = jax.jit(lambda data: {k: GridInterpolant(X, Y, d, k)(S, T) for k, d in data.items()})(
        data
    )
    for scheme in data:
        found = np.asarray(run[scheme])
        assert np.all(np.isfinite(found))
        assert normwise(found, part(cases[scheme], 0, 0, S, T)) > 1e-3, scheme


# --- the rest ------------------------------------------------------------------------------------


@pytest.mark.parametrize("bits", [32, 64])
def test_precision_and_derivatives_at_the_corners(bits):
    with jax.enable_x64(bits == 64):
        data = jnp.ones((3, 3, 3))
        p = GridInterpolant(jnp.arange(3.0), jnp.arange(3.0), data, "inverse distance")
        run = eqx.filter_jit(eqx.filter_value_and_grad(lambda p, x: jnp.sum(p(x, x))))
        out, slopes = run(p, jnp.linspace(0.0, 2.0, 9))
        assert out.dtype == f"float{bits}"
        assert all(np.all(np.isfinite(a)) for a in jax.tree.leaves((out, slopes)))


def test_outside_of_the_grid_nothing_is_known():
    p = GridInterpolant([0.0, 1.0], [0.0, 1.0], np.ones((2, 2, 1)), "bilinear")
    found = eqx.filter_jit(p)(np.array([-0.01, 0.0, 1.0, 0.5]), np.array([0.5, 0.0, 1.0, 1.01]))
    assert np.isnan(found).tolist() == [True, False, False, True]


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: GridInterpolant([0.0, 0.0], [0.0, 1.0], np.ones((2, 2, 3))), "in rising order"),
        (lambda: GridInterpolant([0.0], [0.0, 1.0], np.ones((1, 2, 3))), "two or more"),
        (lambda: GridInterpolant([0.0, 1.0], [0.0, 1.0], np.ones((2, 3, 3))), "must have shape"),
        (lambda: GridInterpolant([0.0, 1.0], [0.0, 1.0], np.ones((2, 2, 1))), "hold gradients"),
        (lambda: GridInterpolant([0.0, 1.0], [0.0, 1.0], np.ones((2, 2, 3)), "cubic"), "one of"),
        (
            lambda: GridInterpolant(
                [0.0, 1.0], [0.0, 1.0], np.ones((2, 2, 3)), labels=jnp.zeros((3, 2), int)
            ),
            "`labels` must have shape",
        ),
        (
            lambda: GridInterpolant([0.0, 1.0], [0.0, 1.0], np.ones((2, 2, 3)))(0.5, 0.5, 1),
            "if and only if",
        ),
    ],
)
def test_bad_input_is_one_sentence(make, words):
    with pytest.raises(ValueError, match=words):
        make()


@pytest.mark.parametrize("scheme", SCHEMES)
def test_what_is_no_number_on_another_object_does_not_leak(scheme):
    x = jnp.arange(4.0)
    labels = jnp.asarray(np.arange(4)[:, None] >= 2, int) + jnp.zeros((4, 4), int)

    def found(elsewhere):
        data = jnp.stack(jnp.broadcast_arrays(x[:, None] * x, x, x[:, None]), -1)
        data = jnp.where(labels[..., None] == 1, elsewhere, data)
        f = reconstruction.GridInterpolant(x, x, data, scheme, labels)
        return f(1.3, 1.6, 0), *jax.grad(lambda x, y: f(x, y, 0), (0, 1))(1.3, 1.6)

    np.testing.assert_array_equal(found(jnp.nan), found(0.0))
    assert np.isfinite(found(jnp.nan)).all()


def test_traced_nodes_that_do_not_rise_give_nan():
    def value(x):
        data = jnp.ones((3, 2, 1))
        return reconstruction.GridInterpolant(x, jnp.arange(2.0), data, "bilinear")(0.5, 0.5)

    assert jnp.isnan(jax.jit(value)(jnp.array([0.0, 2.0, 1.0])))
    assert jax.jit(value)(jnp.array([0.0, 1.0, 2.0])) == 1.0
