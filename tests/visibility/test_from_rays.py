"""Edges found by rays: bisected to rounding, and limbs that one hit beside them misses."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.checks.tolerance import fitted_order
from firstorder.visibility import (
    EdgeAngle,
    VisibilityEdges,
    bracket_edges,
    circle_edge_angle,
    from_rays,
    point_edge_angle,
    shading,
    tangent_points,
    visible_edges,
)

CENTER, RADIUS, SLAB = (0.5, 1.7), 0.4, ((-0.4, 1.0), (-1.1, 1.3))


def hits(position=(0.0, 0.0)):
    """First hits of rays from a place, for a disc and a slab; plain geometry."""
    w = jnp.array(CENTER) - jnp.asarray(position)
    a, b = (jnp.array(e) - jnp.asarray(position) for e in SLAB)

    def hit(angle):
        u = jnp.stack([-jnp.sin(angle), jnp.cos(angle)], -1)
        near = u @ w
        inside = near**2 - w @ w + RADIUS**2
        met = (inside > 0) & (near > 0)
        disc = jnp.where(met, near - jnp.sqrt(jnp.where(met, inside, 1.0)), jnp.inf)
        side_a, side_b = (u[..., 0] * e[1] - u[..., 1] * e[0] for e in (a, b))
        edge = b - a
        det = u[..., 0] * edge[1] - u[..., 1] * edge[0]
        t = (a[0] * edge[1] - a[1] * edge[0]) / jnp.where(det == 0, 1.0, det)
        slab = jnp.where((side_a * side_b < 0) & (t > 0), t, jnp.inf)
        return jnp.minimum(disc, slab)

    return hit


@jax.jit
def exact(position=(0.0, 0.0)):
    """The four edges in order of angle: the disc is to the right, the slab to the left."""
    low = [circle_edge_angle(CENTER, RADIUS, 1.0, position), point_edge_angle(SLAB[0], position)]
    high = [
        circle_edge_angle(CENTER, RADIUS, -1.0, position),
        point_edge_angle(SLAB[1], position, side=-1.0),
    ]
    stack = lambda *a: jnp.stack(a)  # noqa: E731
    return [jax.tree.map(stack, *pair) for pair in (low, high)]


ANGLES = np.linspace(-1.55, 1.55, 256)


@jax.jit
def found(position):
    hit = hits(position)
    edges = bracket_edges(lambda a: hit(a) < jnp.inf, jnp.asarray(ANGLES), size=6)
    return edges, tangent_points(hit, edges)


def test_an_edge_between_two_rays_far_apart_is_found_to_rounding():
    rays, places = jnp.array([-1.0, 1.0]), jnp.asarray(np.sin(np.arange(1.0, 30.0)))
    found = jax.vmap(lambda e: bracket_edges(lambda a: a < e, rays, size=1).angle[0])(places)
    np.testing.assert_allclose(found, places, rtol=0.0, atol=1.5 * 2.0**-53)


def test_blockers_as_narrow_as_a_step_are_told_apart():
    """An edge in each of many steps, of any length, and none in others."""
    rng = np.random.default_rng(0)
    rays = np.cumsum(rng.uniform(0.01, 0.1, 40)) - 1.0
    steps = np.sort(rng.choice(39, 31, replace=False))
    truth = rays[steps] + rng.uniform(0.05, 0.95, 31) * np.diff(rays)[steps]
    blocked = lambda a: jnp.searchsorted(jnp.asarray(truth), a) % 2 == 1  # noqa: E731
    edges = jax.jit(lambda rays: bracket_edges(blocked, rays, size=33))(jnp.asarray(rays))
    assert edges.count == 31
    np.testing.assert_allclose(edges.angle, [*truth, 0.0, 0.0], rtol=0.0, atol=4e-16)
    np.testing.assert_array_equal(edges.sign, [*np.where(np.arange(31) % 2, -1, 1), 0, 0])


def test_edges_are_bisected_to_rounding():
    edges, _ = found(jnp.zeros(2))
    low, high = exact()
    truth = np.stack([low.value, high.value]).T.ravel()  # disc low, disc high, slab low, slab high
    # Whether a ray grazes a disc is decided by a difference of squares of numbers near one.
    np.testing.assert_allclose(edges.angle[:4], truth, rtol=0.0, atol=2e-15)
    np.testing.assert_array_equal(edges.sign, [1, -1, 1, -1, 0, 0])
    assert edges.count == 4


def test_limbs_of_discs_and_corners():
    _, points = found(jnp.zeros(2))
    low, high = exact()
    truth = np.stack([low.distance, high.distance]).T.ravel()
    # The sixth-order remainder: 6! h^6 = 1.6e-11 with h = sqrt(reach) / 6, times a coefficient.
    np.testing.assert_allclose(points.distance[:4], truth, rtol=1e-9)
    np.testing.assert_allclose(points.radius[:4], [RADIUS, RADIUS, 0, 0], rtol=0.0, atol=1e-6)
    # The outward normal of the disc at its limb.
    at = points.distance[0] * np.array([-np.sin(points.angle[0]), np.cos(points.angle[0])])
    normal = np.array([-np.sin(points.normal[0]), np.cos(points.normal[0])])
    np.testing.assert_allclose((at - np.array(CENTER)) / RADIUS, normal, rtol=0.0, atol=1e-8)


def test_the_jets_of_found_edges():
    _, points = found(jnp.array([0.3, -0.1]))
    low, high = exact((0.3, -0.1))
    ours, low, high = points.edges().along(), low.along(), high.along()
    for name, rtol in (("value", 1e-14), ("first", 1e-9), ("second", 1e-5)):
        truth = np.stack([getattr(low, name), getattr(high, name)]).T.ravel()
        np.testing.assert_allclose(getattr(ours, name)[:4], truth, rtol=rtol)
    curved = points.edges().along(kappa=0.4)
    np.testing.assert_allclose(curved.first, ours.first - 0.4, rtol=1e-14)


def test_one_hit_beside_a_round_limb_is_wrong_by_the_square_root_of_the_step():
    """sqrt(2 r D delta), with its factor; beside a corner the error is of first order."""
    hit, (low, _) = hits(), exact()
    steps = np.logspace(-9, -3, 7)
    errors = {
        name: np.abs(low.distance[i] - np.asarray(hit(low.value[i] + jnp.asarray(steps))))
        for i, name in enumerate(("disc", "slab"))
    }
    assert abs(fitted_order(steps, errors["disc"]) - 0.5) < 0.01
    predicted = np.sqrt(2.0 * RADIUS * float(low.distance[0]) * steps)
    np.testing.assert_allclose(errors["disc"][:4], predicted[:4], rtol=1e-2)
    assert abs(fitted_order(steps, errors["slab"]) - 1.0) < 0.01
    # At R07's 512 samples this is a few per cent of the distance, and so of B_x.
    assert errors["disc"][-1] / low.distance[0] > 0.02


def test_more_hits_are_of_higher_order():
    reaches = (1e-2, 4e-2)

    @jax.jit
    def distances(edges):
        each = [
            [tangent_points(hits(), edges, r, k).distance[0] for r in reaches] for k in (1, 2, 3)
        ]
        return jnp.array(each)

    errors = np.abs(np.asarray(distances(found(jnp.zeros(2))[0])) - float(exact()[0].distance[0]))
    for points, error in zip((1, 2, 3), errors, strict=True):
        assert abs(fitted_order(np.sqrt(reaches), error) - points) < 0.4


@jax.jit
def shaded_by_rays_and_by_shapes():
    hit = hits()
    points = tangent_points(
        hit, bracket_edges(lambda a: hit(a) < jnp.inf, jnp.asarray(ANGLES), size=6)
    )
    a, zero = points.edges().along(), jnp.zeros((6, 2, 2))
    first, second = zero[:, 0].at[:, 0].set(a.first), zero.at[:, 0, 0].set(a.second)
    traced = VisibilityEdges(EdgeAngle(a.value, first, second, a.jump), jnp.array(1.0))
    T = lambda x, t, w: jnp.cos(w) * (1.0 + 0.3 * jnp.sin(w + t))  # noqa: E731
    return [shading(T, 0.0, 0.2, edges) for edges in (traced, visible_edges(*exact()))]


def test_shading_from_rays_is_the_shading_from_shapes():
    """R07 §6.3's semi-analytic gradient, and here the Hessian too."""
    ours, truth = shaded_by_rays_and_by_shapes()
    np.testing.assert_allclose(ours.value, truth.value, rtol=1e-14)
    np.testing.assert_allclose(ours.gradient.total, truth.gradient.total, rtol=1e-8)
    np.testing.assert_allclose(ours.hessian.total, truth.hessian.total, rtol=1e-5)


@jax.jit
def comb_of(teeth, width, shift):
    """Edges of a comb of blockers, of a given width each, from 64 rays and four slots."""
    blocked = lambda a: jnp.cos(teeth * (a - shift)) > jnp.cos(teeth * 0.5 * width)  # noqa: E731
    return bracket_edges(blocked, jnp.linspace(-1.0, 1.0, 64), size=4)


def test_what_is_narrower_than_a_step_is_not_seen():
    assert comb_of(3.0, 2e-4, 0.1).count == 0
    assert comb_of(3.0, 0.1, 0.1).count == 2


def test_too_few_slots_are_not_an_answer():
    edges = comb_of(20.0, 0.15, 0.1)
    assert edges.count > 4
    assert np.all(np.isnan(edges.angle))


def test_a_sliver_has_no_limb():
    """Blocked for less than the reach: NaN and not a number that looks right."""

    @jax.jit
    def sliver():
        hit = lambda a: jnp.where(jnp.abs(a) < 1e-5, 1.0, jnp.inf)  # noqa: E731
        edges = bracket_edges(lambda a: hit(a) < jnp.inf, jnp.linspace(-1.0, 1.0, 101), size=3)
        points = tangent_points(hit, edges)
        return points.distance, points.edges().along().first

    distance, alpha_x = sliver()
    assert np.all(np.isnan(distance[:2]))
    assert np.all(np.isnan(alpha_x[:2]))
    assert np.isfinite(alpha_x[2])  # an empty slot


@pytest.mark.smoke
def test_bad_counts_are_one_sentence():
    with pytest.raises(
        ValueError, match=r"^Argument `size` must be a positive integer, but is 0.$"
    ):
        bracket_edges(lambda a: a > 0, jnp.zeros(3), size=0)
    edges = found(jnp.zeros(2))[0]
    with pytest.raises(ValueError, match=r"^Argument `reach` must be positive, but is 0.0.$"):
        tangent_points(lambda a: a, edges, reach=0.0)


def test_single_precision_with_three_hits():

    @jax.jit
    def one(angles):
        hit = hits()
        edges = bracket_edges(lambda a: hit(a) < jnp.inf, angles, size=4)
        return tangent_points(hit, edges, reach=3e-2, points=3).distance

    with jax.enable_x64(False):
        distance = one(jnp.asarray(ANGLES, "float32"))
        assert distance.dtype == "float32"
    np.testing.assert_allclose(distance[0], exact()[0].distance[0], rtol=2e-3)


# --- faults --------------------------------------------------------------------------------------


def nearest_hit(points):
    """The distance of the hit nearest to the edge, as if that were the limb."""
    return np.eye(points)[0], np.eye(points)[0] * 0.0


def in_angle(points):
    """A polynomial in delta instead of its root."""
    inverse = np.linalg.inv(np.vander(np.arange(1.0, points + 1.0) ** 2, increasing=True))
    return inverse[0], inverse[1]


FAULTS = {"none": from_rays._at_zero, "nearest hit": nearest_hit, "in the angle": in_angle}


@functools.cache
def faulty():
    """The distance of the first limb with each, compiled as one."""

    @jax.jit
    def all_of(edges):
        out = []
        for weights in FAULTS.values():
            with pytest.MonkeyPatch.context() as patch:
                patch.setattr(from_rays, "_at_zero", weights)
                out.append(tangent_points(hits(), edges).distance[0])
        return out

    return dict(zip(FAULTS, all_of(found(jnp.zeros(2))[0]), strict=True))


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_in_the_limb_is_seen(fault):
    distance = faulty()[fault]
    assert np.isfinite(distance)
    error = abs(distance / exact()[0].distance[0] - 1.0)
    assert error < 1e-9 if fault == "none" else error > 1e-4


def test_angles_that_fall_are_refused():
    with pytest.raises(ValueError, match="angles"):
        bracket_edges(lambda a: jnp.abs(a) < 0.3, jnp.linspace(1.0, -1.0, 20), size=2)
