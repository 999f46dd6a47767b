"""What scenes, receivers and derivatives print, in both worlds."""

import equinox as eqx
import jax
import jax.numpy as jnp
import pytest

from firstorder import flatland, space
from firstorder.scene._derivatives import Derivatives


def test_a_scene_of_flatland_says_what_is_where():
    scene = flatland.Scene.of(
        flatland.primitive(
            flatland.Segments((-1.0, 0.0), (1.0, 0.0)), name="floor", albedo=0.5, mirror=0.25
        ),
        flatland.primitive(flatland.Segments((0.5, 1.0), (-0.5, 1.0)), name="lamp", emission=2.0),
        flatland.primitive(flatland.Circles([(0.0, 0.5), (1.0, 0.5)], [0.25, 0.5]), ior=1.5),
        points=flatland.PointLights([(0.0, 2.0), (1.0, 2.0)], [1.0, 1.0]),
        environment=flatland.ConstantSky(1.0),
    )
    assert repr(scene).splitlines() == [
        "Scene of flatland: 4 shapes, x -1 to 1.5 m, y 0 to 1 m",
        "  floor      1 segment  x -1 to 1, y 0            albedo 0.5, mirror 0.25",
        "  lamp       1 segment  x -0.5 to 0.5, y 1        emits 2",
        "  (no name)  2 circles  x -0.25 to 1.5, y 0 to 1  refracts 1.5",
        "  2 point lights: x 0 to 1, y 2",
        "  sky: ConstantSky",
    ]
    assert str(scene) == repr(scene)


def test_a_scene_of_space_says_what_is_where():
    scene = space.Scene.of(
        space.primitive(space.plane((0.0, 0.0, -1.0), (0.0, 0.0, 1.0)), name="floor"),
        space.primitive(space.plane((0.0, 0.0, 0.0), (0.0, 0.6, 0.8)), name="slope"),
        space.primitive(space.box((0.0, 0.0, 0.0), (1.0, 2.0, 3.0)), name="box", emission=0.5),
        environment=2.0,
    )
    assert repr(scene).splitlines() == [
        "Scene of space: 3 shapes, x 0 to 1 m, y 0 to 2 m, z 0 to 3 m",
        "  box    1 box    x 0 to 1, y 0 to 2, z 0 to 3  emits 0.5",
        "  floor  1 plane  z -1",
        "  slope  1 plane  without end",
        "  sky: 2 from everywhere",
    ]


def test_a_plain_function_is_a_sky_by_its_name():
    def morning(angle):
        return jnp.cos(angle)

    floor = flatland.primitive(flatland.Segments((-1.0, 0.0), (1.0, 0.0)))
    scene = flatland.Scene.of(floor, environment=morning)
    assert repr(scene).endswith("sky: morning")


def test_many_names_are_counted():
    things = [
        flatland.primitive(flatland.Circles((float(i), 0.0), 0.1), name=f"drop {i}")
        for i in range(30)
    ]
    lines = repr(flatland.Scene.of(*things)).splitlines()
    assert len(lines) == 9
    assert lines[-1] == "  ... and 23 more names or kinds"


@pytest.mark.parametrize("world", ["flatland", "space"])
def test_without_numbers_a_scene_says_so(world):
    shape = {
        "flatland": lambda: flatland.primitive(flatland.Circles((0.0, 0.0), 1.0)),
        "space": lambda: space.primitive(space.sphere((0.0, 0.0, 0.0), 1.0)),
    }[world]()
    scene = {"flatland": flatland, "space": space}[world].Scene.of(shape)
    seen = []
    jax.jit(lambda scene: [seen.append(repr(scene)), 0.0][1])(scene)
    jax.jit(lambda x: [seen.append(repr(scene)), x][1])(0.0)  # not traced itself
    seen.append(repr(jax.tree.map(lambda leaf: jnp.stack([leaf] * 2), scene)))
    seen.append(repr(eqx.filter_eval_shape(lambda: scene)))
    seen.append(repr(eqx.partition(scene, eqx.is_array)[1]))
    head = f"Scene of {world}: 1 shape"
    assert [line.splitlines()[0] for line in seen] == [
        f"{head}, traced",
        repr(scene).splitlines()[0],
        f"{head}, in a batch of (2,)",
        f"{head}, without numbers",
        f"{head}, their numbers taken out",
    ]


def test_a_batch_of_places_alone_is_a_batch():
    def at(x):
        return flatland.Segments(jnp.stack([x, 0.0]), jnp.stack([x + 1.0, 0.0]))

    one = flatland.Scene.of(flatland.primitive(at(jnp.array(0.0))))
    many = eqx.tree_at(lambda s: s.groups, one, (jax.vmap(at)(jnp.arange(3.0)),))
    assert repr(many) == "Scene of flatland: 1 shape, in a batch of (3,)"


def test_bands_are_told_each_and_are_no_batch():
    ball = space.primitive(space.sphere((0.0, 0.0, 1.0), 0.5), name="ball", albedo=(0.8, 0.2, 0.1))
    assert repr(space.Scene.of(ball, environment=(1.0, 0.5, 0.25))).splitlines() == [
        "Scene of space: 1 shape, x -0.5 to 0.5 m, y -0.5 to 0.5 m, z 0.5 to 1.5 m",
        "  ball  1 ellipsoid  x -0.5 to 0.5, y -0.5 to 0.5, z 0.5 to 1.5  albedo (0.8, 0.2, 0.1)",
        "  sky: (1, 0.5, 0.25) from everywhere",
    ]
    walls = flatland.box((0.0, 0.0), (1.0, 1.0), inward=True)
    room = flatland.Scene.of(flatland.primitive(walls, name="room", emission=[(1.0, 0.5, 0.2)]))
    assert repr(room).splitlines()[1].endswith("emits (1, 0.5, 0.2)")


@pytest.mark.parametrize(
    ("world", "zeros", "ones"),
    [(flatland, "0, 0", "0.707, 0.707"), (space, "0, 0, 0", "0.577, 0.577, 0.577")],
)
def test_a_receiver_says_where_it_is_and_where_it_looks(world, zeros, ones):
    name, d = world.__name__.rpartition(".")[2], zeros.count("0")
    at = world.Receiver.at(jnp.zeros(d), jnp.ones(d), on=3)
    assert repr(at) == f"Receiver of {name} at ({zeros}) m, normal ({ones}), on shape 3"
    assert repr(world.Receiver.at(1e9 * jnp.ones(d))).count("1e+09") == d
    row = world.Receiver.at(jnp.stack([jnp.zeros(d), jnp.ones(d)]))
    assert repr(row).startswith(f"Receiver of {name}, in a batch of (2,): x 0 to 1 m, y 0 to 1 m")
    assert repr(world.Receiver.at(jnp.zeros((0, d)))) == f"Receiver of {name}, in a batch of (0,)"


@pytest.mark.parametrize(("world", "d"), [(flatland, 2), (space, 3)])
def test_without_numbers_a_receiver_says_so(world, d):
    at = world.Receiver.at(jnp.zeros(d))
    traced = []
    jax.make_jaxpr(lambda r: traced.extend([repr(r), repr(at)]))(at)
    assert traced[0].endswith(", traced")
    assert traced[1] == repr(at)
    assert repr(jax.tree.map(lambda a: None, at)).endswith(", its numbers taken out")
    assert repr(jax.eval_shape(lambda r: r, at)).endswith(", without numbers")


def test_derivatives_are_a_table():
    second = jnp.array([[1.0, -0.5], [-0.5, 12.0]])
    d = Derivatives(jnp.array(0.25), jnp.array([3.0, -4.0]), second, ("x", "tilt"))
    assert repr(d).splitlines() == [
        "Value 0.25 and derivatives by x, tilt",
        "                  x  tilt",
        "  first           3    -4",
        "  second x        1  -0.5",
        "  second tilt  -0.5    12",
    ]
    printed = []
    jax.make_jaxpr(lambda x: printed.append(repr(d)))(1.0)
    assert printed == [repr(d)]
    assert repr(jax.vmap(lambda k: d)(jnp.arange(2))).startswith("Derivatives(")
    assert repr(jax.tree.map(lambda a: None, d)).startswith("Derivatives(")
