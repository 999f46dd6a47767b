import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.caching import occlusion as module
from firstorder.caching.occlusion import occlusion_table
from firstorder.space import Scene, box, primitive, rectangle
from firstorder.space.bounces._radiance_maps import RadianceMaps
from firstorder.space.estimators._triangulation import hemisphere_triangulation
from firstorder.space.estimators.occlusion_aware import occlusion_aware_estimate

PLACES = np.array([[0.1, 0.2], [0.45, 0.5], [0.8, 0.3]])
LOW, HIGH = np.array([0.35, 0.3, 0.25]), np.array([0.6, 0.6, 0.35])
RAYS = 64


def scene(at):
    """A lamp over the unit square, and a box between them; the floor is shape 0."""
    level = rectangle(np.add(at, (0.5, 0.5, 0.0)), (0.5, 0.0, 0.0), (0.0, 0.5, 0.0))
    lamp = rectangle(np.add(at, (0.5, 0.5, 1.0)), (0.0, 0.4, 0.0), (0.4, 0.0, 0.0))
    solid = box(at + LOW, at + HIGH)
    return Scene.of(primitive(solid), primitive(level, name="floor"), primitive(lamp, name="light"))


def lit(at=(0.0, 0.0, 0.0)):
    found = scene(np.array(at))
    L = np.zeros((8, 2, 2))  # six faces of the box, then floor and lamp
    L[7] = 1.0
    return RadianceMaps(found, jnp.asarray(L)), found.named("floor")[0]


def by_slabs(place, w):
    """Radiance and distance of rays, written out for this scene."""
    o = np.append(place, 0.0)
    with np.errstate(divide="ignore"):
        t = np.sort([(LOW - o) / w, (HIGH - o) / w], axis=0)
        up = 1.0 / w[:, 2]
    enter, leave = t[0].max(1), t[1].min(1)
    solid = np.where((enter < leave) & (enter > 0.0), enter, np.inf)
    above = np.all(np.abs(place + up[:, None] * w[:, :2] - 0.5) < 0.4, axis=1)
    lamp = np.where(above, up, np.inf)
    return np.where(lamp < solid, 1.0, 0.0), np.minimum(lamp, solid)


@pytest.fixture(scope="module")
def expected():
    net = hemisphere_triangulation(RAYS)
    w = np.asarray(net.directions, float)
    run = jax.jit(occlusion_aware_estimate)
    found = []
    for place in PLACES:
        L, r = (jnp.asarray(a, net.directions.dtype) for a in by_slabs(place, w))
        found.append(run(L, net.directions, r, net.triangles, net.neighbours))
    columns = [np.stack([np.asarray(f[k], float) for f in found]) for k in range(3)]
    shortest = [by_slabs(place, w)[1].min() for place in PLACES]
    return [PLACES, *columns, np.array(shortest)]


def worst(expected):
    maps, floor = lit()
    found = occlusion_table(maps, PLACES, floor, rays=RAYS)
    pairs = zip(found, expected, strict=True)
    return max(np.max(np.abs(a - b)) / np.max(np.abs(b)) for a, b in pairs)


BOUND = 1e-4  # single precision, differences of Lambert's terms of opposite sides


def test_a_table_is_what_the_rays_of_each_place_give(expected):
    assert worst(expected) < BOUND


def test_a_table_far_from_the_origin_is_the_same():
    far = np.array([3e6, -4e6, 2e6])  # where a metre has two steps of single precision
    maps, floor = lit()
    near = occlusion_table(maps, PLACES, floor, rays=RAYS)
    maps, floor = lit(far)
    found = occlusion_table(maps, PLACES + far[:2], floor, height=far[2], rays=RAYS)
    for a, b in zip(found[1:], near[1:], strict=True):
        np.testing.assert_allclose(a, b, rtol=0.0, atol=1e-4 * np.max(np.abs(b)))


def alone(net):
    """No ray has neighbours: what varies behind edges is left out."""
    own = jnp.arange(net.directions.shape[0])[:, None]
    return net._replace(neighbours=jnp.broadcast_to(own, net.neighbours.shape))


def mirrored(net):
    """Triangles turn the other way."""
    return net._replace(directions=net.directions * jnp.array([-1.0, 1.0, 1.0], jnp.float32))


SINGLE = module._single


@pytest.mark.parametrize("fault", [alone, mirrored])
def test_a_fault_is_noticed(expected, fault, monkeypatch):
    monkeypatch.setattr(module, "_single", lambda net: fault(SINGLE(net)))
    assert worst(expected) > 100.0 * BOUND


def test_wrong_input_is_refused():
    maps, floor = lit()
    with pytest.raises(ValueError, match="`rays` must be a positive integer"):
        occlusion_table(maps, PLACES, floor, rays=0)
    with pytest.raises(ValueError, match="`position` must"):
        occlusion_table(maps, np.zeros((2, 3)), floor, rays=RAYS)
