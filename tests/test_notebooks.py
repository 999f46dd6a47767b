"""Every notebook runs from top to bottom, and its sliders redraw fast.

Each in a process of its own: a notebook decides about precision for itself.
"""

import json
import pathlib
import subprocess
import sys

import pytest

from tests.machine import slower

FOLDER = pathlib.Path(__file__).parents[1] / "notebooks"
NOTEBOOKS = sorted(f.stem for f in FOLDER.glob("*.py"))

RUN = """
import json, sys
sys.path.insert(0, {folder!r})
import {name} as notebook
outputs, defs = notebook.app.run(defs={{"size": {size}}})
"""

REDRAW = """
import time
sliders = [(0.1, -1.0, -1.5, 0.05), (1.0, 0.2, 0.4, 0.2), (2.5, 1.0, 1.5, 0.3)]
pictures = [defs["png"](*s)[0] for s in sliders]
assert len(set(pictures)) == 3, "sliders change nothing"
assert all(p[1:4] == b"PNG" for p in pictures)

def cost(k):
    begin = time.process_time(), time.perf_counter()
    defs["png"](1.0 + 0.01 * k, 0.2, 0.4, 0.2)
    return time.process_time() - begin[0], time.perf_counter() - begin[1]

print(json.dumps(min(cost(k) for k in range(30))))
"""

ACCURACY = """
import equinox as eqx, jax.numpy as jnp, numpy as np
x, theta = np.meshgrid(np.linspace(-1, 1, 7), np.linspace(-0.8, 0.8, 6), indexing="ij")
Omega = np.meshgrid(np.linspace(-2, 2, 6), np.linspace(-2, 2, 5), indexing="ij")

@eqx.filter_jit
def draw(sliders, **finer):
    path = notebook.path(*sliders, **finer)
    return path.light(x, theta), jnp.abs(path.spectra[-1](*Omega))

def error(sliders):
    fine = draw(sliders, half_width=9.0, harmonics=601, nodes=96)
    return [float(jnp.max(abs(a - b)) / jnp.max(b)) for a, b in zip(draw(sliders), fine)]

print(json.dumps([error(jnp.array(s)) for s in [(1.0, 0.2, 0.4, 0.2), (2.5, 0.3, 1.5, 0.3)]]))
"""


def run(name, size, code=""):
    program = RUN.format(folder=str(FOLDER), name=name, size=size) + code
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_a_notebook_runs_at_quick_size(name):
    run(name, 16)


def test_the_path_has_converged_and_redraws_in_a_tenth_of_a_second_once_compiled():
    (seconds, elapsed), errors = run("light_field_path", 64, REDRAW + ACCURACY)
    # Processor time, summed over threads: other processes on the machine do not enter.
    assert seconds < 0.1 * slower(), f"{seconds:.3f} s of processor time, {elapsed:.3f} s in all"
    assert max(map(max, errors)) < 1e-3  # below a shade out of 256, in radiance and in |F|
