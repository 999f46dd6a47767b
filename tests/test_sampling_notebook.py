"""The notebook of an image on a budget: its light is right, and its sliders do what it says.

In a process of its own: a notebook decides about precision for itself.
"""

import json
import pathlib
import subprocess
import sys

import numpy as np

FOLDER = pathlib.Path(__file__).parents[1] / "notebooks"

PROGRAM = """
import json, sys
sys.path.insert(0, {folder!r})
import image_on_a_budget as notebook
import jax, jax.numpy as jnp, numpy as np
from firstorder.space import Scene, primitive, receiver, rectangle
from firstorder.space.direct_lighting import irradiance

_, defs = notebook.app.run(defs={{"size": 48}})
hits, truth = (defs[k] for k in ("hits", "truth"))
start = (500, notebook.BY_ALL, 1.5, 1.0)
others = [(900, *start[1:]), (500, notebook.EVEN, *start[2:]),
          (500, notebook.BY_DIFFERENCES, *start[2:]), (500, notebook.BY_LIGHT, *start[2:]),
          (*start[:2], 6.0, 1.0), (*start[:3], 4.0)]
pictures = [defs["png"](*s)[0] for s in (start, *others)]
assert len(set(pictures)) == len(pictures), "a slider changes nothing"
assert all(p[1:4] == b"PNG" for p in pictures)

def errors(*sliders):
    _, image, expected = notebook.painted(hits, sliders)
    return [float(np.sqrt(np.mean(a**2))) for a in (image - truth, expected)]

print(json.dumps([errors(*s) for s in (start, *others[:2])]))
light = notebook.LIGHT
lamp = primitive(rectangle(light.center, light.u, light.v), emission=(light.radiance, 0.0))
scene = Scene.of(*notebook.THINGS, lamp)
floor = notebook.SCENE.named("floor")[0]
points, there = hits.position[hits.index == floor], truth[hits.index == floor]
some = points[:: len(points) // 60]
E = jax.lax.map(lambda x: irradiance(scene, receiver(x, on=scene.named("floor")[0])), some)
found = there[:: len(points) // 60]
print(json.dumps([np.asarray(E).tolist(), found.tolist()]))
"""


def test_sliders_move_the_picture_and_the_error_follows_the_budget():
    program = PROGRAM.format(folder=str(FOLDER))
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    (few, many, even), (E, found) = map(json.loads, done.stdout.splitlines())
    assert many[0] < 0.8 * few[0] < 0.8 * even[0]
    for measured, expected in (few, many):
        assert 0.5 < expected / measured < 2.0
    # Exact silhouettes and cosines. 256 stratified rays err by some 256^(-3/4) of the lamp, and
    # the share of it that is seen stands for what that share sends.
    light = 0.7 / np.pi * np.array(E)
    assert np.mean(light < 0.8 * light.max()) > 0.2, "no shadow among the points"
    np.testing.assert_allclose(found, light, rtol=0.0, atol=0.03 * light.max())
