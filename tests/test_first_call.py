"""Programs stay small: what a user waits for at a first call is bounded, for each entry point.

Counting only traces, and a count is the same on every machine. Bounds are what was measured; who
makes a program smaller lowers its bound. Older versions of JAX trace others.
"""

import json
import os
import subprocess
import sys

import jax
import pytest

from tests.first_calls import calls, equations

MOST = {
    "flatland E": 901,
    "flatland gradient": 1029,
    "flatland Hessian": 1534,
    "scene_d E": 1358,
    "scene_d E''": 1860,
    "flatland light field, integrated, jet": 3105,
    "flatland radiosity": 2646,
    "space E": 1181,
    "space gradient": 1492,
    "space Hessian": 2917,
    "space derivatives": 2774,
    "space light field, jet": 1413,
    "space light field, integrated, jet": 4167,
    "azimuth integral": 5929,
    "path, jet": 1056,
    "path, spectrum": 352,
    "shadow field, spectrum": 74,
    "cache": 82,
    "tile of pixels": 3680,
}
# These were counted with it.
VERSION = (0, 10)


@pytest.fixture(scope="module")
def entries():
    return calls()


def test_every_entry_point_has_a_bound(entries):
    assert set(entries) == set(MOST)


def test_a_call_inside_counts():
    def called(x):
        return jax.jit(lambda y: y * 2.0)(x) + 1.0

    assert equations(called, 1.0) == 3  # a call, a product, a sum


@pytest.mark.skipif(jax.__version_info__[:2] != VERSION, reason="counted with another JAX")
@pytest.mark.parametrize("name", MOST)
def test_programs_stay_small(entries, name):
    function, args = entries[name]
    assert equations(function, *args) <= MOST[name]


# What is done before light is asked for; each line is counted in one process, one after the other.
PREPARED = """
import json
import jax
from firstorder import flatland, session, space
from firstorder.fields import GaussianProfile, gaussian
from firstorder.flatland import library
from firstorder.transport import Curvature, Mirror, Reflection, Travel

session.start()
jax.numpy.asarray(0.5).block_until_ready()
count = [0]


def listen(event, seconds, **about):
    count[0] += event == "/jax/core/compile/backend_compile_duration"


jax.monitoring.register_event_duration_secs_listener(listen)


def flatland_scene():
    lamp = flatland.primitive(flatland.Segments((0.5, 1.0), (-0.5, 1.0)), emission=1.0)
    disc = flatland.primitive(flatland.Circles((0.1, 0.5), 0.1))
    return flatland.Scene.of(lamp, disc), flatland.Receiver.at((0.3, 0.0))


def on_a_shape():
    scene = library.named_scene("scene_d")
    return flatland.receiver(scene, scene.named("floor")[0], 0.3)


def space_scene():
    lamp = space.primitive(space.box((-0.5, -0.5, 1.0), (0.5, 0.5, 1.1)), emission=1.0)
    ball = space.primitive(space.sphere((0.1, 0.05, 1.0), 0.2), albedo=0.5)
    disc = space.primitive(space.disc((1.0, 0.0, 0.5), (1.0, 0.0, 0.0), 0.2))
    return space.Scene.of(lamp, ball, disc), space.Receiver.at((0.25, 0.25, 0.0))


def path():
    lobe = Reflection(GaussianProfile(0.2))
    light = gaussian((0.2, 0.1), (0.5, 0.3))
    return (light >> Curvature(0.4) >> Mirror() >> lobe >> Curvature(0.4, back=True)).light


def jet():
    return path().jet([0.3, -0.1])


found = {}
for make in (flatland_scene, on_a_shape, space_scene, path, jet):
    count[0] = 0
    jax.block_until_ready(jax.tree.leaves(make()))
    found[make.__name__] = count[0]
print(json.dumps(found))
"""
# Programs that are compiled, some 20 ms each. Operation by operation they were 25, 68, 55, 28, 176.
PROGRAMS = {"flatland_scene": 5, "on_a_shape": 3, "space_scene": 2, "path": 0, "jet": 1}


def test_scenes_and_paths_are_prepared_without_compiling():
    environment = os.environ | {"FIRSTORDER_CACHE": "off"}
    command = [sys.executable, "-c", PREPARED]
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert set(found) == set(PROGRAMS)
    assert {name: n for name, n in found.items() if n > PROGRAMS[name]} == {}
