import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firstorder.checks.cases import bell, light
from firstorder.checks.cases.products.occlusion_edge import CASES as SHARP
from firstorder.checks.squares import square
from firstorder.checks.tolerance import fitted_order
from firstorder.conventions import FLATLAND, FLATLAND_SLOPE, Frame
from firstorder.errors import Refused
from firstorder.fields import Affine, Constant, Grid, covariance_of, gaussian, half_plane
from firstorder.fields.apertures import SoftSlit
from firstorder.flatland import ConstantSky, Receiver, Scene, Segments, irradiance, primitive
from firstorder.transport import Texture, Travel, half_plane_blocker
from firstorder.transport.events.occlusion import (
    Occlusion,
    PlanarBlockers,
    comb_blocker,
    grating_blocker,
    pit_blockers,
    slit_blocker,
)

FRAME = FLATLAND_SLOPE
WINDOW = Grid.spanning((192, 192), (6.0, 6.0))
shares = st.floats(0.0, 1.0)


@pytest.mark.smoke
@given(shares, st.floats(0.0, 3.0), st.floats(-2.0, 2.0), st.floats(-1.5, 1.5))
def test_a_ray_is_dimmed_if_it_meets_the_blocker(share, depth, x, v):
    L = light(FRAME)
    blocker = Occlusion(half_plane(0.1, share, 1.0, "x", FRAME), depth)
    met = x + depth * np.array([-v, 1.0])[0]  # the line along (-v, 1), at the height of the blocker
    expected = bell(x, v) * (share if met < 0.1 else 1.0)
    if abs(met - 0.1) > 1e-9:
        assert abs(blocker(L)(x, v) - expected) < 1e-14


@given(shares, shares)
def test_transparencies_multiply(a, b):
    L, u = light(FRAME), (-0.4, 0.2)
    both = (half_plane_blocker(0.0, FRAME, a) >> half_plane_blocker(0.0, FRAME, b))(L)
    assert abs(both(*u) - half_plane_blocker(0.0, FRAME, a * b)(L)(*u)) < 1e-15


def test_full_transparency_changes_nothing():
    L, u = light(FRAME), jnp.array([0.2, 0.1])
    jet = half_plane_blocker(0.0, FRAME, 1.0)(L).jet(u)
    np.testing.assert_array_equal(jet.hessian, L.jet(u).hessian)


@pytest.mark.parametrize("frame", [FRAME, FLATLAND, Frame(("x", "v"), "outgoing")])
def test_a_blocker_at_a_depth_is_one_before_the_travel(frame):
    """Travel(z) after the blocker, or the blocker sheared to the plane after the travel."""
    L, u = light(frame), jnp.array([0.4, -0.2])
    mask = half_plane(0.2, 0.3, 1.0, "x", frame)
    before = (Occlusion(mask) >> Travel(0.9))(L)
    after = (Travel(0.9) >> Occlusion(mask, 0.9))(L)
    np.testing.assert_allclose(before.jet(u).hessian, after.jet(u).hessian, rtol=1e-13)
    levels = [field.edges()[-1].level(*u) for field in (before, after)]
    np.testing.assert_allclose(*levels, rtol=1e-14)


def test_edges_travel_and_keep_their_jump():
    L = light(FRAME)
    (edge,) = (half_plane_blocker(0.1, FRAME, 0.25) >> Travel(1.4))(L).edges()
    u = jnp.array([0.1 + 1.4 * 0.3, 0.3])  # on it: x - v d = 0.1
    assert abs(edge.level.at(u)) < 1e-15
    assert abs(edge.jump.at(u) - 0.75 * bell(0.1, 0.3)) < 1e-15


def test_the_comb_is_its_bars():
    L, V = light(FRAME), comb_blocker(0.5, 4, FRAME, 0.6, 0.2).transparency
    x = np.linspace(-1.4, 1.4, 58)
    on_a_bar = np.any(np.abs(x[:, None] - 0.5 * (np.arange(4) - 1.5)) < 0.1, axis=1)
    np.testing.assert_allclose(V(x, 0.0), np.where(on_a_bar, 0.2, 1.0))
    assert len(comb_blocker(0.5, 4, FRAME)(L).edges()) == 8


def test_many_bars_tend_to_the_grating():
    L, W = light(FRAME), (0.2, -0.1)
    # Bars of a finite comb are centred on bars: an odd count puts one at x = 0, the grating none.
    endless = grating_blocker(0.8, FRAME, 0.4, 0.0, 0.0, WINDOW)(L.spectrum())(*W)
    many = comb_blocker(0.8, 12, FRAME, 0.4, 0.0, 0.0, WINDOW)(L.spectrum())(*W)
    assert abs(endless - many) < 1e-10


@pytest.mark.parametrize("share", [0.0, 0.25, 1.0])
def test_a_slit_is_two_half_planes(share):
    L, W = light(FRAME), (0.3, 0.2)
    slit = slit_blocker(-0.4, 0.6, FRAME, share, 0.5, WINDOW)(L.spectrum())(*W)
    left = Occlusion(half_plane(-0.4, share, 1.0, "x", FRAME), 0.5, WINDOW)(L.spectrum())(*W)
    right = Occlusion(half_plane(0.6, 1.0, share, "x", FRAME), 0.5, WINDOW)(L.spectrum())(*W)
    assert abs(slit - (left + right - L.spectrum()(*W))) < 1e-12


def test_the_grid_error_of_a_sampled_edge_is_of_second_order():
    case = next(c for c in SHARP if c.name == "occlusion, slit")
    sizes = [64, 128, 256]
    errors = [
        square(
            dataclasses.replace(case, grid=Grid.spanning((n, n + 1), (4.5, 3.5))), "spectrum"
        ).error
        for n in sizes
    ]
    assert fitted_order(sizes, errors) < -1.7


def test_a_sharp_edge_has_no_covariance():
    S = light(FRAME).covariance()
    for blocker in (
        half_plane_blocker(0.0, FRAME),
        slit_blocker(0.0, 1.0, FRAME),
        grating_blocker(1.0, FRAME),
    ):
        with pytest.raises(Refused, match="an edge has"):
            blocker(S)


def test_a_soft_slit_adds_to_the_covariance_approximately():
    """Exact for Gaussians alone: 0.03 % off for a bell-like slit, 21 % for a nearly sharp one."""
    L, errors = light(FRAME), []
    for blur in (0.1, 0.3, 0.9):
        step = Occlusion(SoftSlit(Affine([1.0, 0.0], 0.0, FRAME), 1.0, blur))
        true = covariance_of(step(L), Grid.spanning((384, 64), (5.0, 4.0))).matrix
        errors.append(np.max(np.abs(step(L.covariance()).matrix - true)) / np.max(true))
    assert errors[0] > errors[1] > errors[2]
    assert errors[2] < 1e-3
    assert errors[0] < 0.25


def test_without_a_window_the_spectrum_takes_one_that_holds_the_light():
    F, V = light(FRAME).spectrum(), half_plane(0.1, 0.25, 1.0, "x", FRAME)
    ours, wide = (Occlusion(V, 0.7, w)(F)(0.3, 0.2) for w in (None, WINDOW))
    assert abs(ours - wide) < 1e-13


@pytest.mark.parametrize("sheets", [1, 2, 5])
def test_pits_are_exact_up_to_the_slope_at_which_rays_step_over_a_wall(sheets):
    period, depth, share = 0.8, 0.6, 0.7
    wall = (1.0 - share) * period
    rng = np.random.default_rng(sheets)
    x = 0.5 * share * period * rng.uniform(-1.0, 1.0, 4000)
    v = rng.uniform(-1.5, 1.5, 4000) * sheets * wall / depth
    V = pit_blockers(period, depth, sheets, FRAME, share)(Constant(1.0, FRAME))
    leaks = np.asarray(V(x, v)) != (np.abs(x - v * depth) < 0.5 * share * period)
    slow = np.abs(v) <= sheets * wall / depth
    assert not np.any(leaks & slow)
    assert np.any(leaks & ~slow)


def test_pits_get_the_skys_light_and_at_most_what_leaks():
    """Between two walls, exact, against the event's light in slopes: dtheta is dv / (1 + v^2)."""
    period, depth, share = 0.8, 0.6, 0.7
    half = 0.5 * share * period
    walls = [primitive(Segments((s * half, 0.0), (s * half, depth))) for s in (-1.0, 1.0)]
    scene = Scene.of(*walls, environment=ConstantSky())
    x = half * np.array([-0.9, -0.2, 0.5])
    exact = jax.vmap(lambda at: irradiance(scene, at))(Receiver.at(np.stack([x, 0.0 * x], -1)))
    theta = (np.arange(40_000) + 0.5) * np.pi / 40_000 - 0.5 * np.pi
    for sheets in (1, 4):
        V = pit_blockers(period, depth, sheets, FRAME, share)(Constant(1.0, FRAME))
        found = np.asarray(V(x[:, None], np.tan(theta))) @ np.cos(theta) * np.pi / 40_000
        steep = sheets * (1.0 - share) * period / depth
        most = 2.0 * (1.0 - steep / np.hypot(1.0, steep))
        assert np.all(found > exact - 2e-4)
        assert np.all(found < exact + most + 2e-4)
        assert np.max(found - exact) > 0.02 * most


def test_the_spectrum_behind_pits_is_that_of_their_light():
    L, W = gaussian((0.1, 0.0), (0.5, 0.4), 0.0, 1.0, FRAME), (0.9, -0.4)
    window = Grid.spanning((256, 256), (3.0, 2.6))
    pits = pit_blockers(1.0, 0.6, 2, FRAME, 0.6, window)
    n = 3000
    x, v = (reach * ((np.arange(n) + 0.5) * 2.0 / n - 1.0) for reach in (3.0, 2.6))
    light = np.exp(-0.5 * (((x[:, None] - 0.1) / 0.5) ** 2 + (v / 0.4) ** 2))
    for depth in (0.3, 0.6):
        away = x[:, None] - depth * v
        light = light * (np.abs(away - np.round(away)) < 0.3)
    waves = [np.exp(-2j * np.pi * o * a) for o, a in zip(W, (x, v), strict=True)]
    expected = waves[0] @ light @ waves[1] * (6.0 / n) * (5.2 / n)
    assert abs(complex(pits(L.spectrum())(*W)) - expected) < 2e-3 * abs(L.spectrum()(0.0, 0.0))


@pytest.mark.smoke
def test_bad_blockers_are_one_sentence():
    with pytest.raises(ValueError, match="Argument `sheets` must be a positive integer"):
        pit_blockers(1.0, 0.5, 0, FRAME)
    with pytest.raises(ValueError, match="Argument `depth` must not be negative"):
        pit_blockers(1.0, -0.5, 2, FRAME)
    with pytest.raises(
        ValueError, match=r"^Argument `transparency` must lie in \[0, 1\], but is 2"
    ):
        half_plane_blocker(0.0, FRAME, 2.0)
    with pytest.raises(ValueError, match=r"`right` must be greater than `left` = 1.0, but is 0.0"):
        slit_blocker(1.0, 0.0, FRAME)
    for share in (0.0, 1.0):
        with pytest.raises(
            ValueError, match=rf"^Argument `open` must lie in \(0, 1\), but is {share}"
        ):
            comb_blocker(1.0, 3, FRAME, open=share)
    with pytest.raises(ValueError, match=r"Argument `period` must be one number"):
        comb_blocker([1.0, 2.0], 3, FRAME)
    with pytest.raises(TypeError, match=r"Argument `frame` must be a `Frame`|violates type hint"):
        comb_blocker(1.0, 3, "x")
    with pytest.raises(TypeError, match=r"Argument `frame` must be a `Frame`|violates type hint"):
        half_plane_blocker(0.0, "x")
    with pytest.raises(ValueError, match="Argument `depth` must be one number"):
        pit_blockers(1.0, [0.5, 1.0, 1.5], 2, FRAME)
    with pytest.raises(ValueError, match="Argument `period` must be positive"):
        comb_blocker(0.0, 3, FRAME)
    for count in (0, 2.5):  # with the import hook beartype is first
        words = "^Argument `count` must be a positive integer, but is|violates type hint"
        with pytest.raises((ValueError, TypeError), match=words):
            comb_blocker(1.0, count, FRAME)
    with pytest.raises(ValueError, match="Argument `depths` must have 1 entries"):
        PlanarBlockers((half_plane(0.0, frame=FRAME),), [0.0, 1.0])
    with pytest.raises(ValueError, match="Argument `d` must not be negative"):
        Occlusion(half_plane(0.0, frame=FRAME), -1.0)(light(FRAME))
    with pytest.raises(ValueError, match="Argument `transparency` of Occlusion must be over"):
        half_plane_blocker(0.0, FRAME)(light(FLATLAND))


def test_two_layers_dim_a_ray_that_meets_either():
    L = light(FRAME)
    V = half_plane(0.0, 0.5, 1.0, "x", FRAME)
    both = PlanarBlockers((V, V), [0.4, 1.2])(L)
    for x, v in ((0.3, 0.1), (0.3, 0.5), (0.3, 1.0)):
        blocked = (x - 0.4 * v < 0) + (x - 1.2 * v < 0)
        assert abs(both(x, v) - bell(x, v) * 0.5**blocked) < 1e-15
    assert len(both.edges()) == 2


def wedge_share(z1, z2, keep):
    """Share of the energy of `keep(V1, V2)` outside the wedge between the lines of two layers.

    Light of the cases' kind, wide; attenuations of two soft slits; sampled and transformed. The
    window blurs every line, so a margin of six widths of its spectrum counts as inside.
    """
    n, half = 256, 9.0
    axis = (np.arange(n) - (n - 1) / 2) * (2 * half / n)
    X, V = np.meshgrid(axis, axis, indexing="ij")
    sigma = 1.4
    masks = [
        np.asarray(
            Occlusion(SoftSlit(Affine([1.0, 0.0], -p, FRAME), 0.5, 0.2), z).law(FRAME).factor(X, V)
        )
        for z, p in ((z1, -0.3), (z2, 0.3))
    ]
    light = np.exp(-(X**2 + V**2) / (2 * sigma**2)) * keep(*masks)
    power = np.abs(np.fft.fft2(light)) ** 2
    W = np.fft.fftfreq(n, axis[1] - axis[0])
    Wx, Wv = np.meshgrid(W, W, indexing="ij")
    low, high = np.minimum(-z1 * Wx, -z2 * Wx), np.maximum(-z1 * Wx, -z2 * Wx)
    margin = 6.0 / (2 * np.pi * sigma * np.sqrt(2)) * np.sqrt(1.0 + z2**2)
    outside = (Wv < low - margin) | (Wv > high + margin)
    return float(np.sum(power[outside]) / np.sum(power))


def test_the_wedge_holds_for_sums_and_not_for_products():
    """D05 §3.2: sums of attenuations stay between the lines s (1, -z); products leave them."""
    added = wedge_share(0.4, 1.2, lambda a, b: a + b)
    multiplied = wedge_share(0.4, 1.2, lambda a, b: a * b)
    assert added < 1e-9
    assert multiplied > 1e-3


def test_a_planar_stack_has_one_line():
    assert wedge_share(1.0, 1.0, lambda a, b: a * b) < 1e-9


def test_gradients_pass_through_the_blocker_parameters():
    def shadow(edge, depth, share):
        V = half_plane(edge, share, 1.0, "x", FRAME)
        return Occlusion(V, depth)(light(FRAME)).at(jnp.array([-0.3, 0.1]))

    gradient = jax.grad(shadow, argnums=(0, 1, 2))(0.2, 0.4, 0.3)
    np.testing.assert_allclose(gradient, [0.0, 0.0, bell(-0.3, 0.1)], rtol=0.0, atol=1e-15)


def test_a_window_may_be_smaller_than_the_plane():
    """Light in a corner: only the window's own extent matters, not its place."""
    L = gaussian((3.0, -1.0), (0.3, 0.25), 0.2, 1.0, FRAME)
    near = Grid.spanning((128, 128), (2.5, 2.2), (3.0, -1.0))
    wide = Grid.spanning((512, 512), (8.0, 8.0))
    W, V = (0.4, -0.2), half_plane(3.4, 0.0, 1.0, "x", FRAME)
    small, large = (eqx.filter_jit(Occlusion(V, 0.5, w)(L.spectrum()))(*W) for w in (near, wide))
    assert abs(small - large) < 1e-12


@pytest.mark.smoke
def test_a_planar_blocker_depends_on_the_position_alone_in_angles_too():
    """From below the line too, where a glossy lobe looks; a texture of that pattern is the same."""
    mask = half_plane(0.1, 0.3, 1.0, "x", FLATLAND)
    blocked, painted = Occlusion(mask)(light(FLATLAND)), Texture(mask)(light(FLATLAND))
    np.testing.assert_array_equal(blocked(0.4, 1.9), painted(0.4, 1.9))
    np.testing.assert_allclose(blocked.spectrum()(0.3, 0.2), painted.spectrum()(0.3, 0.2))


@pytest.mark.parametrize(
    "made",
    [
        lambda share: half_plane_blocker(0.1, FRAME, share),
        lambda share: slit_blocker(-0.2, 0.5, FRAME, share),
        lambda share: comb_blocker(1.0, 3, FRAME, 0.5, share),
        lambda share: grating_blocker(1.0, FRAME, 0.5, share),
        lambda share: comb_blocker(1.0, 3, FRAME, 0.9 * share + 0.05),
    ],
)
def test_traced_shares_outside_of_their_interval_give_nan(made):
    look = jax.jit(lambda share: made(share)(light(FRAME))(-0.45, 0.0))
    assert np.isnan(look(-0.1))
    assert np.isnan(look(1.1))
    assert np.isfinite(look(0.0))
    assert np.isfinite(look(1.0))
