"""The notebook of a sphere and a box: its sliders move the picture, and its light is right.

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
import sphere_and_box as notebook
import jax.numpy as jnp, numpy as np

_, defs = notebook.app.run(defs={{"size": 16}})
start = list(notebook.START)
pictures = [defs["png"](*start)[0]]
for k, step in enumerate((0.3, 0.2, -0.3, -0.3, 0.4, 0.4)):
    pictures.append(defs["png"](*(s + step * (i == k) for i, s in enumerate(start)))[0])
assert len(set(pictures)) == 7, "a slider changes nothing"
assert all(p[1:4] == b"PNG" for p in pictures)

# There is no value under the box, and only there.
shown = notebook.Shown(16)
found = notebook.portraits(shown, jnp.array(start))
under = np.abs(np.stack(np.meshgrid(shown.x - start[2], shown.x), -1)).max(-1) < 0.15
assert under.any() and all((np.isnan(found[k]).T == under).all() for k in ("E", "slope"))

# The box far away: what is left is the sphere, whose light has a closed form.
found = notebook.portraits(notebook.Shown(16), jnp.array([0.2, 0.7, 60.0, 0.3, 0.0, 0.2]))
print(json.dumps([np.asarray(found[k], float).tolist() for k in ("E", "dE")]))
"""


def test_sliders_move_the_picture_and_the_sphere_alone_is_the_closed_form():
    program = PROGRAM.format(folder=str(FOLDER))
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    E, slope = map(np.array, json.loads(done.stdout.splitlines()[-1]))
    a = 1.5 * (2.0 * np.arange(16) - 15.0) / 16
    x, y = np.meshgrid(a - 0.2, a, indexing="ij")
    d2 = x**2 + y**2 + 0.7**2
    hidden = np.pi * 0.4**2 * 0.7
    np.testing.assert_allclose(E, np.pi - hidden / d2**1.5, rtol=0.0, atol=1e-4)  # single precision
    truth = 3.0 * hidden * np.stack([x, y], -1) / d2[..., None] ** 2.5
    np.testing.assert_allclose(slope, truth, rtol=0.0, atol=1e-3)
