import jax
import jax.numpy as jnp
import numpy as np
import pytest
import sympy
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from firstorder import caching
from firstorder.caching import (
    EventLines,
    event_lines,
    expected_error_with_lines,
    radius_for,
    radius_with_lines,
)
from firstorder.space import (
    Receiver,
    Scene,
    box,
    derivatives,
    irradiance,
    primitive,
    rectangle,
    sphere,
)
from firstorder.space.discontinuities import DiscontinuityMesh, discontinuity_mesh

# Pieces, jumps and a record: whole lines, and pieces that end within the disc.
WORLDS = {
    "a line": (((0.3, -9.0), (0.3, 9.0)), 2.0, 0.0, (0.0, 0.0)),
    "a line where it bends": (((0.3, -9.0), (0.3, 9.0)), 0.0, 3.0, (0.0, 0.0)),
    "a short piece": (((0.2, 0.1), (0.4, 0.7)), 1.5, 2.0, (-0.1, 0.2)),
    "a piece beside the foot": (((0.5, 0.3), (0.5, 0.6)), 1.0, 1.0, (0.1, 0.0)),
    "a piece at the record": (((0.0, -0.3), (0.0, 0.5)), 1.0, 0.0, (0.0, 0.0)),
}


def one(ends, kink, bend, root=None):
    return EventLines(
        [ends[0]], [ends[1]], [kink], [bend], None if root is None else np.array([root])
    )


def by_quadrature(R, ends, kink, bend, place, root=0.0):
    """Over a disc: each ray from the record that meets the piece goes wrong beyond it."""
    p, q = (np.array(e) - place for e in ends)
    across = np.array([p[1] - q[1], q[0] - p[0]]) / np.linalg.norm(q - p)
    offset = across @ p
    if offset == 0.0:  # the piece is at the record: half of all rays
        return 2.0 / 3.0 * kink * R**3
    middle = np.arctan2(*(np.sign(offset) * across)[::-1])

    def along_ray(psi):
        cosine = np.cos(psi)
        far = abs(offset) / cosine

        def miss(r):
            x = (r - far) * cosine
            return (kink * x + 0.5 * bend * x**2 + 4.0 / 3.0 * root * x**1.5) * r

        return quad(miss, far, R)[0] if far < R else 0.0

    a, b = sorted((np.arctan2(*e[::-1]) - middle + np.pi) % (2 * np.pi) - np.pi for e in (p, q))
    most = np.arccos(min(abs(offset) / R, 1.0))
    return quad(along_ray, max(a, -most), min(b, most), epsrel=1e-10)[0]


def worst_error():
    worst = 0.0
    for ends, kink, bend, place in WORLDS.values():
        for R in (0.45, 1.1):
            true = by_quadrature(R, ends, kink, bend, place)
            ours = expected_error_with_lines(R, 0.0, jnp.array(place), one(ends, kink, bend))
            worst = max(worst, abs(float(ours) - true))
    return worst


def test_a_piece_of_a_line_spoils_what_is_behind_it():
    assert worst_error() < 1e-9


@pytest.mark.parametrize("world", ["a line", "a short piece", "a piece beside the foot"])
def test_behind_outlines_that_touch_the_second_derivative_is_one_over_a_root(world):
    ends, *_, place = WORLDS[world]
    for R in (0.45, 1.1):
        true = by_quadrature(R, ends, 0.5, 0.3, place, root=2.0)
        x, lines = jnp.array(place), one(ends, 0.5, 0.3, 2.0)
        ours = expected_error_with_lines(R, 0.0, x, lines)
        np.testing.assert_allclose(ours, true, rtol=1e-4)
    assert true > 1.5 * by_quadrature(R, ends, 0.5, 0.3, place)


FAULTS = {
    "pieces are endless": lambda t, d, R: (jnp.sign(t) * 0.9 * jnp.sqrt(abs(R**2 - d**2)), d, R),
    "the line is at the record": lambda t, d, R: (t, 0.0 * d, R),
    "the disc is half as large": lambda t, d, R: (t, d, 0.5 * R),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_noticed(fault, monkeypatch):
    right = event_lines._to
    monkeypatch.setattr(event_lines, "_to", lambda *args: right(*FAULTS[fault](*args)))
    assert 2e-2 < worst_error() < np.inf


def test_both_integrals_are_those_that_sympy_finds_along_a_ray():
    """The closed forms' slopes along the line, by autodiff, against integrals over the radius."""
    r, R, d, c = sympy.symbols("r R d c", positive=True)  # c: the cosine of the ray
    over = (r - d / c) * c
    rays = [sympy.integrate(sympy.expand(f * r), (r, d / c, R)) for f in (over, over**2 / 2)]
    at = {R: sympy.Float("1.3"), d: sympy.Float("0.4")}
    for t in (-0.9, -0.2, 0.5):
        cosine = 0.4 / np.hypot(0.4, t)
        slopes = jax.jacfwd(lambda t: jnp.stack(event_lines._to(t, *map(jnp.array, (0.4, 1.3)))))(t)
        turn = cosine**2 / 0.4  # of the ray, for a step along the line
        true = [float(f.subs({**at, c: cosine})) * turn for f in rays]
        np.testing.assert_allclose(slopes, true, rtol=1e-12)


def test_without_lines_the_pointwise_radius_comes_out():
    none = EventLines(np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0), np.zeros(0))
    x = jnp.zeros((3, 2))

    def both(size, options):
        ours = radius_with_lines(size, 0.1, 1e-3, 50.0, x, none, **options)
        return ours, radius_for(size, 0.1, dims=2, **options)

    asked = [
        {"order": order, "definition": definition, "value": 0.8}
        for order in (0, 1, 2)
        for definition in ("total", "average", "relative")
    ]
    of_all = jax.jit(lambda size: [both(size, options) for options in asked])
    for ours, true in of_all(np.array([0.4, 2.0, 9.0])):
        np.testing.assert_allclose(ours, true, rtol=1e-12)


@given(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(0.0, 1.0), st.floats(0.0, 6.3))
def test_a_cut_piece_and_a_turned_plane_are_the_same(x, y, share, turn):
    p, q, place = np.array([0.3, -0.6]), np.array([0.5, 0.8]), np.array([x, y])
    middle = p + share * (q - p)
    c, s = np.cos(turn), np.sin(turn)
    Q = np.array([[c, -s], [s, c]])
    whole = EventLines([p], [q], [1.2], [0.7])
    for other, where in (
        (EventLines([p, middle], [middle, q], [1.2, 1.2], [0.7, 0.7]), place),
        (EventLines([q], [p], [-1.2], [-0.7]), place),
        (EventLines([Q @ p], [Q @ q], [1.2], [0.7]), Q @ place),
    ):
        ours = expected_error_with_lines(0.9, 2.0, jnp.array(where), other)
        true = expected_error_with_lines(0.9, 2.0, jnp.array(place), whole)
        np.testing.assert_allclose(ours, true, rtol=1e-9)


def test_the_radius_reaches_the_tolerance_and_its_slope_is_that_of_the_root():
    ends, kink, bend, place = WORLDS["a short piece"]
    lines, x = one(ends, kink, bend), jnp.array(place)

    def radius(tolerance):
        return radius_with_lines(0.3, tolerance, 1e-3, 9.0, x, lines)

    R = radius(0.2)
    np.testing.assert_allclose(expected_error_with_lines(R, 0.3, x, lines), 0.2, rtol=1e-12)
    slope = jax.jit(jax.grad(lambda R: expected_error_with_lines(R, 0.3, x, lines)))(R)
    turn = jax.jit(jax.grad(radius))
    np.testing.assert_allclose(turn(0.2), 1.0 / slope, rtol=1e-9)
    bent = (turn(0.2 + 1e-5) - turn(0.2 - 1e-5)) / 2e-5
    np.testing.assert_allclose(jax.jit(jax.grad(turn))(0.2), bent, rtol=1e-6)
    assert radius_with_lines(0.3, 1e-12, 0.1, 9.0, x, lines) == 0.0
    assert jnp.isposinf(radius_with_lines(0.3, 1e9, 0.1, 9.0, x, lines))


def test_degenerate_pieces_and_places_have_finite_errors_and_slopes():
    start, end = [[0.0, -1.0], [0.2, 0.2], [1.0, -1.0]], [[0.0, 1.0], [0.2, 0.2], [1.0, 1.0]]
    lines = EventLines(start, end, *np.ones((3, 3)))

    def error(R, x):
        return expected_error_with_lines(R, 1.0, x, lines)

    both = jax.jit(jax.value_and_grad(error, (0, 1)))
    for x in ([0.0, 0.0], [0.0, 1.0], [0.2, 0.2], [1.0, -1.0]):
        for R in (0.0, 1.0):
            found = both(R, np.array(x))
            assert all(jnp.all(jnp.isfinite(a)) for a in jax.tree.leaves(found))


def test_single_precision_stays_single_and_right():
    ends, kink, bend, place = WORLDS["a short piece"]
    with jax.enable_x64(False):
        lines = one(ends, kink, bend)
        found = expected_error_with_lines(1.1, 0.0, jnp.array(place), lines)
    assert found.dtype == jnp.float32
    np.testing.assert_allclose(found, by_quadrature(1.1, ends, kink, bend, place), rtol=1e-5)


SQUARE = rectangle((0.0, 0.0, 2.0), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0))
DARK = {
    "a box": (SQUARE, box((-0.4, -0.3, 0.9), (0.4, 0.3, 1.0)), 0.25, 33, 0.2),
    "a ball": (SQUARE, sphere((0.0, 0.0, 1.0), 0.45), 0.15, 129, 0.17),
    "two balls": (sphere((0.0, 0.0, 2.2), 0.5), sphere((-0.1, 0.0, 1.0), 0.45), 0.15, 257, 0.1),
}
LEFT = {"a box": 0.02, "a ball": 0.03, "two balls": 0.03}  # by the next term, and by chords


@pytest.mark.parametrize("name", DARK)
def test_lines_of_a_mesh_know_how_far_the_dark_reaches(name):
    """In full shadow all derivatives are zero; what a record misses there is all behind lines."""
    lamp, block, x, points, R = DARK[name]
    scene = Scene.of(primitive(lamp, emission=1.0), primitive(block))
    at = Receiver.at((x, 0.03, 0.0))
    lines = EventLines.of(discontinuity_mesh(scene, at, points=points, reach=0.3), at)
    found = derivatives(irradiance, scene, at)
    assert not jnp.any(found.hessian)
    r, w = np.polynomial.legendre.leggauss(24)
    r, w = 0.5 * R * (r + 1.0), 0.5 * R * w
    phi = (np.arange(48) + 0.5) * np.pi / 24
    x = r[:, None, None] * np.stack([np.cos(phi), np.sin(phi)], -1)
    E = jax.jit(jax.vmap(lambda s: irradiance(scene, at.moved(s))))(jnp.array(x.reshape(-1, 2)))
    true = np.sum(E.reshape(x.shape[:2]) * (r * w)[:, None]) * np.pi / 24
    ours = expected_error_with_lines(R, 0.0, jnp.zeros(2), lines)
    # Behind a line a jump tells the first term: 1 % is left behind the box, 0.5 % at half of R.
    np.testing.assert_allclose(ours, true, rtol=LEFT[name])


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda e: EventLines([[0, 0]], [[1, 1]], [1.0], [1.0, 2.0]), r"`bend` must have shape"),
        (
            lambda e: EventLines.of(
                DiscontinuityMesh((), (), np.zeros(0, str), np.zeros(0, int)),
                Receiver.at(np.zeros((1, 3))),
            ),
            r"`at` must be one concrete receiver",
        ),
        (lambda e: expected_error_with_lines(-1.0, 1.0, jnp.zeros(2), e), r"`radius`"),
        (
            lambda e: expected_error_with_lines(1.0, 1.0, jnp.zeros(3), e),
            r"`position` must have shape \(..., 2\), but has \(3,\)",
        ),
        (lambda e: radius_with_lines(1.0, 0.0, 0.1, 1.0, jnp.zeros(2), e), r"`tolerance`"),
        (
            lambda e: radius_with_lines(1.0, 0.1, 0.1, 1.0, jnp.zeros(2), e, definition="largest"),
            r"`definition` must be one of \['total', 'average', 'relative'\]",
        ),
    ],
)
def test_bad_input_is_one_sentence(call, words):
    lines = EventLines([[0.0, 0.0]], [[1.0, 1.0]], [1.0], [1.0])
    with pytest.raises(ValueError, match=words):
        call(lines)


def test_a_place_that_is_no_number_has_no_radius():
    line = EventLines([[0.0, -9.0]], [[0.0, 9.0]], [1.5], [0.0])
    assert np.isnan(radius_with_lines(0.0, 1.0, 0.01, 9.0, np.array([np.nan, 0.0]), line))


def test_limits_of_a_radius_are_in_order():
    line = EventLines([[0.0, -9.0]], [[0.0, 9.0]], [1.5], [0.0])
    with pytest.raises(ValueError, match=r"`high` must be at least 9, but is 0\.01"):
        radius_with_lines(0.0, 1.0, 9.0, 0.01, np.zeros(2), line)


@pytest.mark.parametrize("value", [0.0, -1.0])
def test_a_relative_error_wants_a_value(value):
    line = caching.EventLines([[0.0, -9.0]], [[0.0, 9.0]], [1.5], [0.0])

    def error(value):
        return caching.expected_error_with_lines(
            1.0, 1.0, jnp.zeros(2), line, definition="relative", value=value
        )

    with pytest.raises(ValueError, match="Argument `value` must be positive"):
        error(value)
    assert jnp.isnan(jax.jit(error)(value))
    # Nothing is asked of it otherwise: black places have a total error.
    total = expected_error_with_lines(1.0, 1.0, jnp.zeros(2), line, value=value)
    assert total == expected_error_with_lines(1.0, 1.0, jnp.zeros(2), line)
    radii = [
        radius_with_lines(1.0, 0.1, 0.01, 9.0, jnp.zeros(2), line, value=v) for v in (value, 1.0)
    ]
    assert radii[0] == radii[1]
    with pytest.raises(ValueError, match="Argument `value` must be positive"):
        radius_with_lines(
            1.0, 0.1, 0.01, 9.0, jnp.zeros(2), line, definition="relative", value=value
        )
