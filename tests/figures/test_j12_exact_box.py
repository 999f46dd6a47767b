import functools

import jax.numpy as jnp
import numpy as np
import pytest

from figures.j12 import fig18, fig21
from figures.j12.shared import box, exact_box
from figures.j12.shared.exact_box import Room
from firstorder.caching.candidate_tables import gather_directions, tabulate_candidates

# Lit and shadowed places, the last two close to the wall and to the block's foot.
PLACES = np.array([(0.2, 0.3), (0.7, 0.4), (0.62, 0.81), (0.45, 0.9), (0.01, 0.05), (0.56, 0.52)])


@functools.cache
def radiance_maps(name):
    """What the surfaces of a box send, by radiosity."""
    return box.case(name, box.Size(4, 4, 8, 2, 1)).maps


@pytest.fixture(scope="module")
def beside():
    """Light beside the block."""
    return exact_box.blocked_light(Room(), PLACES)


@pytest.fixture(scope="module")
def alone():
    """Light without the block."""
    return exact_box.empty_light(Room(), 40)(PLACES)


@pytest.mark.parametrize("name", ["j12_box", "j12_occluder"])
def test_the_light_is_that_of_the_boxes_radiance_maps(name, alone, beside):
    maps = radiance_maps(name)
    found = alone.E if name == "j12_box" else beside.E
    # Maps of 128 x 128 cells are bilinear; that is all that tells the two apart.
    assert np.allclose(found, box.exact(maps, PLACES), rtol=2e-3)


@pytest.mark.parametrize("name", ["j12_box", "j12_occluder"])
def test_hessians_and_mean_lengths_are_those_of_many_rays(name, alone, beside):
    maps = radiance_maps(name)
    (floor,) = maps.scene.named("floor")
    far = PLACES[:4]  # close to a surface a few rays decide
    table = tabulate_candidates(maps, far, gather_directions(200, 600), floor)
    found = alone if name == "j12_box" else beside
    for one, other in (
        (found.hessian, table.hessian),
        (found.geometric, table.geometric),
        (found.harmonic, table.harmonic),
    ):
        assert np.allclose(one[:4], other, rtol=0.02, atol=0.02 * np.max(np.abs(other)))
    assert np.allclose(found.minimum[:4], table.minimum, rtol=0.02)


def test_the_gradient_beside_the_block_is_that_of_differences(beside):
    h = 1e-5
    for axis in (0, 1):
        step = h * np.eye(2)[axis]
        up, down = (exact_box.blocked_light(Room(), PLACES + s * step).E for s in (1.0, -1.0))
        assert np.allclose((up - down) / (2.0 * h), beside.gradient[:, axis], rtol=0.0, atol=1e-6)


def test_splines_have_the_gradient_and_the_hessian_of_the_light(alone):
    room, nodes = Room(), exact_box.Nodes(24, 20)
    E, gradient, H, G, *_ = exact_box._at_many(room, jnp.asarray(PLACES), False, nodes)
    assert np.allclose(alone.E, E, rtol=1e-4)
    assert np.allclose(alone.gradient, gradient, rtol=2e-3, atol=1e-4)
    assert np.allclose(alone.hessian, H, rtol=5e-2, atol=5e-3)
    assert np.allclose(
        alone.geometric, G, rtol=5e-2, atol=5e-3 * np.abs(G).max((1, 2))[:, None, None]
    )


def test_the_bound_is_no_less_than_the_geometric_hessian(alone, beside):
    for light in (alone, beside):
        most = np.max(np.abs(np.linalg.eigvalsh(light.geometric)), axis=-1)
        assert np.all(light.bound >= most * (1.0 - 1e-3))


def test_what_is_mirrored_is_the_same_light(beside):
    other = exact_box.blocked_light(Room(), PLACES * [1.0, -1.0] + [0.0, 1.0])
    assert np.allclose(other.E, beside.E)
    assert np.allclose(other.gradient, beside.gradient * [1.0, -1.0])
    flip = np.array([[1.0, -1.0], [-1.0, 1.0]])
    assert np.allclose(other.hessian, beside.hessian * flip)
    assert np.allclose(other.geometric, beside.geometric * flip)


def test_many_noisy_rays_have_the_light_and_the_hessians_for_their_mean(alone):
    at = np.repeat(PLACES[:1], 20000, axis=0)
    E, H, G = fig21.gathered(Room(), at, 3)
    for found, exact in ((E, alone.E), (H, alone.hessian), (G, alone.geometric)):
        error = np.std(found, axis=0) / len(at) ** 0.5
        assert np.all(np.abs(np.mean(found, axis=0) - exact[0]) < 5.0 * error)


def test_no_block_shades_the_wall_from_the_lamp():
    for room in exact_box.rooms_with_block(20):
        edge = room.across + room.lamp
        # The ray from the lamp's far edge to the wall's foot passes above the block's near face.
        assert room.block <= room.height * exact_box.BLOCK[0, 0] / edge + 1e-12


def test_an_image_has_rows_along_y_and_nothing_under_the_block():
    x = exact_box.middles(20)
    x = x[exact_box.is_open(x)]
    found = exact_box.image(x, x[:, 0] + 10.0 * x[:, 1])
    assert found.shape == (20, 20)
    assert found[0, 1] == pytest.approx(0.075 + 0.25)
    assert np.isnan(found[7:13, 7:11]).all()
    assert np.isnan(found).sum() == 24


def test_places_hidden_by_the_block_are_those_whose_light_it_changes(alone):
    found = exact_box.blocked_light(Room(albedo=0.0), PLACES).E
    assert np.array_equal(fig18._hidden(PLACES), found < alone.E * (1.0 - 1e-3))
