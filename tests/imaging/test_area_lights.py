"""Near light: every term against autodiff, moving shadows against lines across the lamp."""

import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.tolerance import fitted_order
from firstorder.imaging import Lamp
from firstorder.imaging import _area_lights as module
from firstorder.imaging._area_lights import SurfaceReflectance, shadow_edge_terms
from firstorder.imaging._reflection import SurfacePoint, surface_point
from firstorder.imaging.camera import pinhole
from tests.precision import as_dtype

lit = eqx.filter_jit(module.lobe_radiance)
LAMP = Lamp((0.5, 0.2, 2.0), (0.0, 0.7, 0.1), (0.6, 0.0, 0.2), 3.0, 6)
LOBE = SurfaceReflectance(0.7, 0.3, 12.0)
S = np.array([[-0.5, 0.2], [0.2, 0.8]])
TO_EYE = np.array([-0.3, -0.1, 0.9]) / np.sqrt(0.91)


def sent(lamp, x, n, to_eye, lobe):
    """The two lobes as they are defined, node by node, without any derivative."""
    d = lamp.position - x
    D = jnp.sqrt(jnp.sum(d * d, -1))
    w = d / D[:, None]
    G = lamp.radiance * jnp.maximum(w @ n, 0.0)
    G = G * jnp.maximum(-jnp.sum(w * lamp.area, -1), 0.0) / D**2
    r = 2.0 * n * (n @ to_eye) - to_eye
    polished = jnp.maximum(w @ r, 0.0) ** lobe.exponent
    scale = lobe.specular * (lobe.exponent + 2.0) / (2.0 * jnp.pi)
    return jnp.stack([lobe.albedo / jnp.pi * jnp.sum(G), scale * jnp.sum(G * polished)])


def surface(d):
    """Position and normal of z = d^T S d / 2 about the origin."""
    slope = jnp.asarray(S) @ d
    n = jnp.append(-slope, 1.0)
    return jnp.append(d, 0.5 * d @ slope), n / jnp.sqrt(n @ n)


@pytest.fixture(scope="module")
def found():
    point = surface_point(jnp.zeros(3), jnp.eye(3), jnp.asarray(S))
    return lit(LAMP, jnp.ones(36), point, jnp.asarray(TO_EYE), LOBE)


@pytest.mark.smoke
def test_values_are_as_defined(found):
    up = jnp.array([0.0, 0.0, 1.0])
    true = sent(LAMP, jnp.zeros(3), up, jnp.asarray(TO_EYE), LOBE)
    np.testing.assert_allclose([t.value for t in found], true, rtol=1e-14)


def test_gradients_along_the_surface_and_over_directions_are_exact(found):
    def walked(d, v):
        x, n = surface(d)
        return sent(LAMP, x, n, v, LOBE)

    along, over = jax.jacfwd(walked, (0, 1))(jnp.zeros(2), jnp.asarray(TO_EYE))
    for k, terms in enumerate(found):
        np.testing.assert_allclose(terms.spatial, along[k], rtol=0.0, atol=1e-14)
        np.testing.assert_allclose(terms.angular, over[k], rtol=0.0, atol=1e-14)


def test_terms_are_what_their_names_say(found):
    """SV: the point moves and its normal stays. DV: the frame turns about an axis, in place."""
    up, v = jnp.array([0.0, 0.0, 1.0]), jnp.asarray(TO_EYE)

    def shifted(x):
        return sent(LAMP, x, up, v, LOBE)

    def turned(omega):
        return sent(LAMP, jnp.zeros(3), up + jnp.cross(omega, up), v, LOBE)

    SV = jax.jacfwd(shifted)(jnp.zeros(3))[:, :2]
    change = jax.jacfwd(turned)(jnp.zeros(3))
    for k, terms in enumerate(found):
        np.testing.assert_allclose(terms.SV, SV[k], rtol=0.0, atol=1e-14)
        # The glossy lobe turns by twice what the frame turns.
        np.testing.assert_allclose((k + 1) * terms.DV[:2], change[k, :2], rtol=0.0, atol=1e-14)
        np.testing.assert_allclose(terms.spatial, terms.SV + terms.CDV, rtol=1e-15)


def test_flat_surfaces_have_no_directional_term_and_far_light_no_spatial_one():
    """R07 Fig. 4, two of its rows; and 1/d against twice the curvature, R07 §5.2."""
    flat = surface_point(jnp.zeros(3), jnp.eye(3), jnp.zeros((2, 2)))
    for terms in lit(LAMP, jnp.ones(36), flat, jnp.asarray(TO_EYE), LOBE):
        np.testing.assert_array_equal(terms.CDV, 0.0)
    bent = surface_point(jnp.zeros(3), jnp.eye(3), jnp.asarray(S))
    ratios = []
    for far in (20.0, 40.0):
        lamp = Lamp((far, 0.0, far), (0.0, 0.1, 0.0), (0.1, 0.0, -0.1), 1.0, 4)
        diffuse, _ = lit(lamp, jnp.ones(16), bent, jnp.asarray(TO_EYE), LOBE)
        ratios.append(np.linalg.norm(diffuse.CDV) / np.linalg.norm(diffuse.SV))
    np.testing.assert_allclose(ratios[1] / ratios[0], 2.0, rtol=1e-3)


def test_a_bumpy_points_image_gradient_is_the_images():
    """A normal that is no normal of the surface: t, b, dn given; the camera moves over a plane."""
    camera = pinhole((0.4, -2.0, 1.5), (0.0, 0.0, 0.0), gamma=2.0)
    turning = jnp.array([[0.3, -0.8], [0.5, 0.1], [0.0, 0.0]])
    lean = jnp.array([0.1, -0.05, 1.0])

    def look(p):
        d = camera.direction(p)
        D = -camera.eye[2] / d[2]
        x = camera.eye + D * d
        n = lean + turning @ (x[:2] - at[:2])
        return sent(LAMP, x, n / jnp.sqrt(n @ n), -d, LOBE)

    p = jnp.array([0.1, -0.2])
    d = camera.direction(p)
    D = -camera.eye[2] / d[2]
    at = camera.eye + D * d
    length = jnp.sqrt(lean @ lean)
    n = lean / length
    turns = (turning - n[:, None] * (n @ turning)) / length
    point = SurfacePoint(at, jnp.eye(3)[:, :2], n, turns)
    view = camera.view(p, D, jnp.array([0.0, 0.0, 1.0]))
    true = jax.jacfwd(look)(p)
    for k, terms in enumerate(lit(LAMP, jnp.ones(36), point, -d, LOBE)):
        np.testing.assert_allclose(terms.image_gradient(view, point), true[k], rtol=1e-11)


@pytest.mark.parametrize("fault", ["mirror turns once", "light turns alone", "light stays"])
def test_faults_are_noticed(found, fault):
    """Each is a plausible slip; the exact derivative tells it from the right one."""
    glossy = found[1]
    wrong = {
        "mirror turns once": glossy.SV + 0.5 * glossy.CDV,
        "light turns alone": glossy.CDV,
        "light stays": glossy.SV,
    }[fault]

    def walked(q):
        x, n = surface(q)
        return sent(LAMP, x, n, jnp.asarray(TO_EYE), LOBE)[1]

    true = jax.grad(walked)(jnp.zeros(2))
    assert 1e-2 < np.linalg.norm(wrong - true) / np.linalg.norm(true) < np.inf


# --- shadows -------------------------------------------------------------------------------------

CORNERS = (0.4, 0.1, 3.0), (0.0, 0.7, 0.0), (0.6, 0.0, 0.3)
BALL = np.array([0.1, 0.0, 1.5]), 0.5
CARD = np.array([0.2, -0.5, 1.5]) + np.array(
    [(-0.2, -0.7, -0.1), (0.6, -0.3, -0.1), (0.2, 0.7, 0.1), (-0.6, 0.3, 0.1)]
)


def behind_ball(x, start, step):
    """Where lines `start + t step` of the lamp are hidden by the ball: a cone, quadratic in t."""
    c, y = BALL[0] - x, start - x
    k = c @ c - BALL[1] ** 2
    A = (step @ c) ** 2 - k * (step @ step)
    B, C = (y @ c) * (step @ c) - k * (y @ step), (y @ c) ** 2 - k * np.sum(y * y, -1)
    root = np.sqrt(np.maximum(B * B - A * C, 0.0))
    ends = np.sort([(-B - root) / A, (-B + root) / A], axis=0)
    return np.clip(ends, -1.0, 1.0) if A < 0.0 else None


def behind_card(x, start, step):
    """The same behind a convex polygon: a half-line for each of its edges."""
    low, high = np.full(len(start), -1.0), np.full(len(start), 1.0)
    for p, q in zip(CARD, np.roll(CARD, -1, 0), strict=True):
        side = np.cross(p - x, q - x)
        value, slope = (start - x) @ side, step @ side
        at = np.clip(-value / slope, -1.0, 1.0)
        low, high = (np.maximum(low, at), high) if slope > 0.0 else (low, np.minimum(high, at))
    return np.stack([low, np.maximum(low, high)])


BEHIND = {"ball": (behind_ball, (0.35, -0.2)), "card": (behind_card, (0.1, -0.2))}


def received(x, behind, rows=1500):
    """B of a diffuse floor: what is free of each line across the lamp, by a rule of Gauss."""
    center, u, v = map(np.array, CORNERS)
    area = np.cross(u, v)
    start = center + ((2.0 * np.arange(rows) + 1.0) / rows - 1.0)[:, None] * u
    first, last = behind(x, start, v)
    t, w = np.polynomial.legendre.leggauss(16)
    total = 0.0
    for low, high in ((-1.0 + 0.0 * first, first), (last, 1.0 + 0.0 * last)):
        half = 0.5 * (high - low)[:, None]
        d = start[:, None] + (0.5 * (high + low)[:, None] + half * t)[..., None] * v - x
        f = d[..., 2] * -(d @ area) / np.sum(d * d, -1) ** 2
        total += np.sum(half * w * f) * 2.0 / rows
    return total / np.pi


@functools.cache
def true_gradient(name, h=2e-3):
    behind, place = BEHIND[name]
    x = np.array([*place, 0.0])
    steps = h * np.eye(3)[:2]
    return np.array(
        [(received(x + s, behind) - received(x - s, behind)) / (2.0 * h) for s in steps]
    )


def depths(name, x, y):
    """The share of the way to each node at which the blocker is met; 1 where it is not."""
    d = y - x
    if name == "card":
        normal = np.cross(CARD[1] - CARD[0], CARD[2] - CARD[0])
        tau = ((CARD[0] - x) @ normal) / (d @ normal)
        sides = [np.cross(p - x, q - x) for p, q in zip(CARD, np.roll(CARD, -1, 0), strict=True)]
        hidden = np.all([d @ s > 0.0 for s in sides], axis=0)
    else:
        c, k = BALL[0] - x, np.sum(d * d, -1)
        disc = (d @ c) ** 2 - k * (c @ c - BALL[1] ** 2)
        hidden = disc > 0.0
        tau = (d @ c - np.sqrt(np.maximum(disc, 0.0))) / k
    return np.where(hidden, tau, 1.0)


def shadow_errors(name, count):
    """Of the gradient without and with moving shadows, as shares of the exact one."""
    place, true = BEHIND[name][1], true_gradient(name)
    x, up = jnp.array([*place, 0.0]), jnp.array([0.0, 0.0, 1.0])
    lamp = Lamp(*CORNERS, 1.0, count, True)
    depth = depths(name, np.array(x), np.asarray(lamp.position))
    seen = jnp.asarray((depth == 1.0).astype(float))
    point = surface_point(x, jnp.eye(3), jnp.zeros((2, 2)))
    still, _ = lit(lamp, seen, point, up, SurfaceReflectance(1.0))
    edges, _ = eqx.filter_jit(shadow_edge_terms)(
        lamp, seen, jnp.asarray(depth), point, up, SurfaceReflectance(1.0)
    )
    errors = still.SV - true, still.SV + edges - true
    return [np.linalg.norm(e) / np.linalg.norm(true) for e in errors]


@pytest.mark.parametrize("name", BEHIND)
def test_moving_shadows_come_closer_to_the_exact_gradient_with_more_nodes(name):
    counts = [16, 64, 256]
    without, with_edges = np.array([shadow_errors(name, n) for n in counts]).T
    assert without[-1] > 0.5  # most of the gradient is the edge's
    assert with_edges[-1] < 0.005
    assert fitted_order(counts, with_edges) < -0.8  # edges are known to half a cell


def test_limbs_are_met_too_early_without_their_roots(monkeypatch):
    """The depth of the last hidden node alone errs by the root of a cell."""
    monkeypatch.setattr(module, "TO_LIMB", 0.0)
    assert shadow_errors("ball", 63)[1] > 0.03
    monkeypatch.undo()
    assert shadow_errors("ball", 62)[1] < 0.02


def test_shifted_nodes_of_a_lamp_are_so_far_out_of_the_middles_of_their_cells():
    """Cells of a slanted lamp, in shares of both of its edges from the corner where they start."""
    center, u, v = np.array([(0.5, 0.2, 2.0), (0.0, 0.6, 0.2), (1.0, 0.1, 0.0)])
    lamp = Lamp(center, u, v, 1.0, 4, even=True, shift=(0.3, -0.1))
    corner = np.asarray(lamp.position) - (center - u - v)
    share, rest, *_ = np.linalg.lstsq(2.0 * np.stack([u, v], 1), corner.T)
    along, across = share.reshape(2, 4, 4)
    np.testing.assert_allclose(along[:, 0], (np.arange(4) + 0.8) / 4, rtol=1e-12)
    np.testing.assert_allclose(across[0], (np.arange(4) + 0.4) / 4, rtol=1e-12)
    np.testing.assert_allclose(np.diff(along, axis=1), 0.0, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(np.diff(across, axis=0), 0.0, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(rest, 0.0, rtol=0.0, atol=1e-12)


def test_shadows_need_an_even_lamp():
    point = surface_point(jnp.zeros(3), jnp.eye(3), jnp.zeros((2, 2)))
    ones = jnp.ones(36)
    with pytest.raises(ValueError, match="`lamp` must have even nodes"):
        shadow_edge_terms(LAMP, ones, ones, point, jnp.array([0.0, 0.0, 1.0]), LOBE)


@pytest.mark.parametrize("x", [(0.5, 0.2, 2.0), (0.5, 0.2, 5.0), (0.0, 0.0, -30.0)])
def test_no_nan_in_degenerate_places(x):
    """On the lamp, behind it, below it: finite values, finite gradients."""

    def total(x):
        point = surface_point(x, jnp.eye(3), jnp.asarray(S))
        terms = lit(LAMP, jnp.ones(36), point, jnp.asarray(TO_EYE), LOBE)
        return sum(t.value + jnp.sum(t.spatial) for t in terms)

    value, slope = jax.value_and_grad(total)(jnp.asarray(x))
    assert np.isfinite(value)
    assert np.all(np.isfinite(slope))


def test_lamps_need_nodes():
    with pytest.raises(ValueError, match="`count` must be a positive integer, but is 0"):
        Lamp((0, 0, 1), (1, 0, 0), (0, 1, 0), count=0)


@pytest.mark.parametrize("unit", [1e-10, 1e-9, 1e9])
@pytest.mark.parametrize("even", [False, True])
def test_the_unit_of_length_is_of_no_matter_in_single_precision(unit, even):
    """Radiance is what it was where all lengths are scaled, and what changes per metre scales."""

    def terms(unit):
        edges = [unit * np.array(a) for a in ((0.5, 0.2, 2.0), (0.0, 0.7, 0.1), (0.6, 0.0, 0.2))]
        point = surface_point(jnp.zeros(3), jnp.eye(3), jnp.asarray(S / unit))
        seen, depth = (np.arange(16) % 4 < 2) * 1.0, np.full(16, 0.4)
        given = Lamp(*edges, 3.0, 4, even), seen, depth, point, TO_EYE, LOBE
        lamp, seen, depth, *rest = as_dtype(jax.tree.map(jnp.asarray, given), "float32")
        found = [[a.value, unit * a.spatial] for a in lit(lamp, seen, *rest)]
        if even:
            found.append([unit * a for a in shadow_edge_terms(lamp, seen, depth, *rest)])
        return [np.asarray(a) for a in jax.tree.leaves(found)]

    for a, b in zip(terms(unit), terms(1.0), strict=True):
        assert a.dtype == np.float32
        np.testing.assert_allclose(a, b, rtol=1e-4)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (dict(center=np.array([0.0, np.nan, 1.0])), "`center` must be finite"),
        (dict(u=np.array([0.0, np.inf, 1.0])), "`u` must be finite"),
        (dict(v=np.array([0.0, 1.0])), "`v` must have three coordinates"),
        (dict(radiance=-1.0), "`radiance` must not be negative"),
        (dict(count=0), "`count` must be a positive integer"),
    ],
)
def test_what_is_no_lamp_is_one_sentence(change, words):
    known = dict(center=np.array([0.0, 0.0, 2.0]), u=np.eye(3)[1], v=np.eye(3)[0])
    with pytest.raises(ValueError, match=words):
        Lamp(**(known | change))


@pytest.mark.parametrize("u", [(0.0, 0.0, 0.0), (0.3, 0.6, -0.9)])
def test_a_lamp_without_area_is_refused(u):
    with pytest.raises(ValueError, match=r"^Arguments `u` and `v` must span an area, but do not\."):
        Lamp((0.0, 0.0, 2.0), u, (0.1, 0.2, -0.3))
