import functools
import re

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from derivations.space.estimators.occlusion_aware import (
    HEIGHT,
    INSIDE,
    PLACES,
    SLOPE,
    SMALL,
    both,
    errors,
    estimates,
    gathered,
)
from firstorder.checks.tolerance import fitted_order, rounding
from firstorder.space.estimators import occlusion_aware as module
from firstorder.space.estimators._triangulation import (
    hemisphere_triangulation,
    strata_triangulation,
)
from firstorder.space.estimators.occlusion_aware import occlusion_aware_estimate
from firstorder.space.estimators.strata import hemisphere_strata


@functools.cache
def crossed(rays):
    """Where outlines cross: errors without and with the light that varies behind edges."""
    return [errors(e) for e in estimates(rays)]


@functools.cache
def inside(rays):
    """Where no outlines cross."""
    return errors(estimates(rays, INSIDE, SMALL)[0], INSIDE, SMALL)


def by_surface(L, w, r, n):
    """J12's surface-area Hessian: every hit stays lit, whatever passes before it."""
    seen = np.isfinite(r) & (L > 0)
    y, n = (w * np.where(seen, r, 1.0)[:, None])[seen], n[seen]
    N, R = np.sum(n * y, 1)[:, None], np.sum(y**2, 1)[:, None]
    a, b = -n[:, :2] / N, -2.0 * y[:, :2] / R
    rate = a - 2.0 * b
    H = rate[:, :, None] * rate[:, None] - a[:, :, None] * a[:, None]
    H += 2.0 * b[:, :, None] * b[:, None] - 4.0 * np.eye(2) / R[:, :, None]
    return np.pi / len(L) * np.einsum("m,mij->ij", L[seen], H)


def test_the_error_falls_with_the_rays_where_edges_do_not_cross():
    rays = [256, 1024]
    found = np.array([inside(m)[2] for m in rays])
    assert fitted_order(rays, found) < -0.5
    assert found[-1] < 0.15


def test_crossing_edges_are_seen_in_part():
    """A relative error of 0.5 without what is uncovered stays; with it, it falls."""
    without, with_it = crossed(1024)
    assert without[1] < 0.12
    assert with_it[2] < without[2]


def test_a_penumbra_is_out_of_reach_of_the_surface_area_form():
    w = np.asarray(hemisphere_triangulation(1024).directions, float)
    up = np.array([SLOPE[0], SLOPE[1], -1.0]) / np.linalg.norm([*SLOPE, 1.0])
    found = []
    for x in INSIDE:
        L, r = gathered(x, w, SMALL)
        n = np.where((r * w[:, 2] < 0.9 * HEIGHT / 0.46)[:, None], up, [0.0, 0.0, -1.0])
        H = by_surface(L, w, r, n)
        found.append([0.0, 0.0, 0.0, H[0, 0], H[0, 1], H[1, 1]])
    assert errors(np.array(found), INSIDE, SMALL)[2] > 4.0 * inside(1024)[2]


def test_nothing_changes_under_a_sky_or_a_plane():
    """Light at infinity does not move, and a plane of one radiance looks alike from everywhere."""
    w = hemisphere_strata(8, 24).directions.reshape(-1, 3)
    run, net = jax.jit(occlusion_aware_estimate), strata_triangulation(8, 24)
    _, g, H = run(1.0 + 0.5 * w[:, 0], w, jnp.full(192, jnp.inf, w.dtype), *net)
    assert np.all(np.asarray(g) == 0.0)
    assert np.all(np.asarray(H) == 0.0)
    E, g, H = run(jnp.ones(192, w.dtype), w, 1.0 / w[:, 2], *net)
    assert abs(float(E) - np.pi) < rounding(2000, dtype=w.dtype)
    # A few thousand edges, each with derivatives of at most 1 / r and 1 / r^2.
    assert np.abs(np.asarray(g)).max() < rounding(4000, dtype=w.dtype)
    assert np.abs(np.asarray(H)).max() < rounding(4000, dtype=w.dtype)


def test_an_edge_uncovers_a_sky_that_brightens_towards_it():
    """A roof begins overhead at z = 1, x = 0, under a sky of radiance 1 + x / 2.

    With a the angle of its edge from the normal the sky's light is, as the integral over a lune,
    `E = pi (1 + sin a) / 2 - cos^2(a) / 3`, and a falls by 1 a metre: E_xx = 2 / 3 at a = 0.
    """
    net = hemisphere_triangulation(256)
    w = net.directions
    roof = w[:, 0] > 0.0
    L, r = jnp.where(roof, 0.0, 1.0 + 0.5 * w[:, 0]), jnp.where(roof, 1.0 / w[:, 2], jnp.inf)
    E, g, H = jax.jit(occlusion_aware_estimate)(L, w, r, net.triangles, net.neighbours)
    pitch = 2.0 / 16.0  # of the rays in the projected disc, between which the edge is known
    np.testing.assert_allclose(E, 0.5 * np.pi - 1.0 / 3.0, rtol=0.0, atol=pitch**2)
    np.testing.assert_allclose(g, [-0.5 * np.pi, 0.0], rtol=0.0, atol=2.0 * pitch**2)
    np.testing.assert_allclose(H, [[2.0 / 3.0, 0.0], [0.0, 0.0]], rtol=0.0, atol=pitch)


def test_the_order_of_triangles_and_their_corners_does_not_matter():
    """Nor does rounding: of random distances many rays are nearer than all around them."""
    net, rng = hemisphere_triangulation(64), np.random.default_rng(0)
    seen = rng.uniform(0.0, 1.0, 64), net.directions, np.exp(rng.normal(size=64))
    run = jax.jit(occlusion_aware_estimate)
    turned = np.roll(rng.permutation(net.triangles), 1, 1)
    for ours, other in zip(
        run(*seen, net.triangles, net.neighbours), run(*seen, turned, net.neighbours), strict=True
    ):
        np.testing.assert_allclose(other, ours, rtol=1e-9)


def test_slopes_over_radiance_and_distance_are_finite_at_many_receivers():
    net = hemisphere_triangulation(16)
    seen = [gathered(x, net.directions) for x in PLACES[:2]]
    L, r = (jnp.stack([jnp.asarray(s[i], net.directions.dtype) for s in seen]) for i in (0, 1))

    def trace(L, r):
        return jnp.trace(
            occlusion_aware_estimate(L, net.directions, r, net.triangles, net.neighbours)[2]
        )

    # Along every radiance and every distance at once: one pass, cheap to compile.
    along = jax.jit(jax.vmap(lambda L, r: jax.jvp(trace, (L, r), (L, jnp.ones_like(r)))[1]))
    assert np.isfinite(along(L, r)).all()


def deeper(at, L, step):
    """The boundary moves with the farther surface."""
    parts = CUT(at, L, step)
    far = jnp.minimum(at[3], jnp.roll(at[3], -1, 0))
    inverse = jnp.where(parts.cut, far, parts.middle[3])
    return parts._replace(middle=parts.middle.at[3].set(inverse))


CUT = module._cut
FAULTS = {
    "the farther surface moves": ("_cut", deeper),
    "no cuts": ("_cut", lambda at, L, step: CUT(at, L, 2.0)),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_wrong_boundary_is_seen(fault, monkeypatch):
    monkeypatch.setattr(module, *FAULTS[fault])

    def step(*gathered):
        return both(*gathered[:-1], None)

    wrong = errors(estimates(1024, INSIDE, SMALL, step)[0], INSIDE, SMALL)
    assert 0.15 < wrong[2] < np.inf


BAD = {
    "few radiances": (dict(radiance=np.ones(9)), "`radiance` must have shape (16,), but has (9,)"),
    "other distances": (dict(distances=np.ones(9)), "`distances` must have shape (16,), but has"),
    "no distance": (dict(distances=np.zeros(16)), "`distances` must be positive, but is 0.0"),
    "another net": (dict(triangles=np.array([[0, 1, 99]])), "`triangles` must name 16 rays and"),
    "other neighbours": (dict(neighbours=np.zeros((9, 4), int)), "`neighbours` must have shape"),
    "from the end": (dict(triangles=np.array([[0, 1, -5]])), "`triangles` must name 16 rays and"),
    "a column each": (dict(triangles=np.zeros((3, 42), int)), "`triangles` must have shape (3, 3)"),
    "halves": (
        dict(triangles=np.full((1, 3), 0.5)),
        "`triangles` must name 16 rays and their feet",
    ),
    "no neighbours": (dict(neighbours=np.full((16, 1), 16)), "`neighbours` must name 16 rays, but"),
    "below": (dict(directions=-hemisphere_triangulation(16).directions), "`directions` must hold"),
    "long": (dict(directions=2 * hemisphere_triangulation(16).directions), "`directions` must"),
    "no step": (dict(step=np.nan), "`step` must lie in (0, 1), but is nan"),
    "complex": (dict(radiance=1j * np.ones(16)), "`radiance` must be real"),
}


@pytest.mark.parametrize("name", BAD)
def test_rays_of_another_net_are_refused(name):
    """Others were read in their place: the irradiance of a white sky was 2e-16."""
    given, words = BAD[name]
    net, one = hemisphere_triangulation(16), np.ones(16)
    right = dict(radiance=one, directions=net.directions, distances=one, triangles=net.triangles)
    with pytest.raises(ValueError, match=f"^Argument {re.escape(words)}"):
        occlusion_aware_estimate(**(right | given))


@pytest.mark.parametrize("wrong", [-2.0, 0.0, np.nan])
def test_a_traced_distance_that_is_none_is_nan(wrong):
    """It gave the light of an open sky."""
    net = hemisphere_triangulation(64)

    @jax.jit
    def found(r):
        distances = jnp.where(jnp.arange(64) == 20, r, 1.0)
        rest = net.triangles, net.neighbours
        return occlusion_aware_estimate(jnp.ones(64), net.directions, distances, *rest)

    assert np.all(np.isnan(found(wrong)[1]))
    assert np.all(np.isfinite(found(np.inf)[1]))
