"""What notebooks show: words and a picture that is small, and words alone where there is none."""

import base64
import io
import re
import subprocess
import sys

import jax
import jax.numpy as jnp
import matplotlib
import matplotlib.pyplot as plt
import numpy as np
import pytest
from PIL import Image

from firstorder import flatland, space
from firstorder.caching import Cache, Candidates, circular_regions
from firstorder.conventions import FLATLAND
from firstorder.fields import Function, Grid, SampledSpectrum, Sum, gaussian
from firstorder.io import SpaceFile
from firstorder.plotting import _notebooks
from firstorder.symbolic import UnknownField

LIGHT = gaussian((0.2, 0.1), (0.5, 0.3))


def scene():
    floor = flatland.Segments((-1.0, 0.0), (1.0, 0.0))
    return flatland.Scene.of(flatland.primitive(floor, name="<floor>", emission=1.0))


def solid():
    return space.Scene.of(space.primitive(space.sphere((0.0, 0.0, 0.5), 0.5), name="ball"))


def cache():
    some = Candidates.from_function(jnp.cos, jnp.array([0.0, 1.0]))
    return Cache.of(some, circular_regions(jnp.array([0.5, 0.25]), 0.1, 1.0))


def pictures(text):
    found = re.findall(r'<img width="(\d+)" alt="\w+" src="data:image/png;base64,([^"]+)">', text)
    return [(int(w), Image.open(io.BytesIO(base64.b64decode(data)))) for w, data in found]


THINGS = {
    "scene": (scene, "Scene of flatland: 1 shape, x -1 to 1 m, y 0 m\n  &lt;floor&gt;"),
    "scene of space": (solid, "Scene of space: 1 shape"),
    "field": (lambda: LIGHT, "Gaussian of incoming light over (x, theta)"),
    "spectrum": (LIGHT.spectrum, r"$$\hat{L}(\Omega_{x}, \Omega_{\theta}) ="),
    "cache": (
        cache,
        "Cache of 2 records along a line, order 1\n  x 0 to 1 m; radius 0.25 to 0.5 m",
    ),
}


def shown(thing):
    """HTML; of what has a formula Markdown, as notebooks write formulas nowhere else."""
    ways = [getattr(thing, name, None) for name in ("_repr_html_", "_repr_markdown_")]
    (way,) = [w for w in ways if w is not None]
    return way()


@pytest.mark.smoke
@pytest.mark.parametrize("name", THINGS)
def test_words_and_a_small_picture_are_shown(name):
    make, words = THINGS[name]
    plt.close("all")
    before, backend = dict(matplotlib.rcParams), matplotlib.get_backend()
    text = shown(make())
    assert words in text
    ((width, picture),) = pictures(text)
    assert picture.width == 2 * width  # sharp on fine screens
    assert len(text) < 31_000
    assert len(np.unique(np.asarray(picture.convert("L")))) > 2, "something is drawn"
    assert plt.get_fignums() == []
    assert dict(matplotlib.rcParams) == before
    assert matplotlib.get_backend() == backend


def test_a_picture_full_of_noise_is_small_too_or_has_fewer_colours(monkeypatch):
    noise = jnp.asarray(np.random.default_rng(0).normal(size=(64, 64)))

    def at(x, theta):
        return noise[jnp.int32(32.0 * (x + 1.0)), jnp.int32(64.0 / jnp.pi * (theta + jnp.pi / 2))]

    text = shown(Function(at, FLATLAND))
    ((_, picture),) = pictures(text)
    assert len(text) < 31_000
    assert len(np.unique(np.asarray(picture))) > 16
    monkeypatch.setattr(_notebooks, "MOST", 1)
    ((_, least),) = pictures(shown(Function(at, FLATLAND)))
    assert len(np.unique(np.asarray(least))) <= 16


@pytest.mark.parametrize("name", THINGS)
def test_what_is_traced_is_told_in_words(name):
    seen = []
    jax.jit(lambda thing: [seen.append(shown(thing)), 0.0][1])(THINGS[name][0]())
    assert len(seen) == 1
    assert seen[0]
    assert pictures(seen[0]) == []


def test_what_cannot_be_drawn_is_told_in_words():
    many = jax.tree.map(lambda leaf: jnp.stack([leaf] * 3), scene())
    empty = jax.tree.map(lambda leaf: None, solid())
    for thing, words in (
        (many, "Scene of flatland: 1 shape, in a batch of (3,)"),
        (empty, "Scene of space: 1 shape, their numbers taken out"),
        (UnknownField("L", frame=FLATLAND), "UnknownField of incoming light over (x, theta)"),
        (jax.tree.map(lambda leaf: jnp.stack([leaf] * 3), cache()), "is a batch of (3,)"),
    ):
        text = shown(thing)
        assert words in text
        assert pictures(text) == []


def test_a_notebook_does_not_wait_for_what_takes_long(monkeypatch):
    long = Sum((LIGHT,) * 100, jnp.ones(100))
    assert pictures(shown(long)) == []
    monkeypatch.setattr(_notebooks, "SHAPES", 0)
    assert pictures(shown(scene())) == pictures(shown(solid())) == []
    assert len(pictures(shown(LIGHT))) == 1


def test_a_spectrum_of_samples_is_drawn_below_its_words():
    text = shown(SampledSpectrum.of(LIGHT, Grid((65, 65), (0.1, 0.1))))
    assert text.index("no formula") < text.index("<img")


PRINTED = """
import sys
from firstorder import caching, fields, flatland, space
floor = flatland.primitive(flatland.Segments((-1.0, 0.0), (1.0, 0.0)), name="floor")
repr(flatland.Scene.of(floor))
assert "matplotlib" not in sys.modules
print(flatland.Scene.of(floor)._repr_html_()[:6])
assert "matplotlib" in sys.modules
assert "matplotlib.pyplot" not in sys.modules
"""


def test_matplotlib_is_loaded_when_a_picture_is_asked_for():
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", PRINTED], capture_output=True, text=True, check=True
    )
    assert done.stdout.startswith("<div><")


def test_a_file_of_a_scene_has_the_picture_of_the_scene():
    ball = space.primitive(space.sphere((0.0, 0.0, 0.5), 0.5), name="ball")
    text = shown(SpaceFile((ball,)))
    assert "SpaceFile: 1 shape, x -0.5 to 0.5 m" in text
    ((_, one),), ((_, other),) = pictures(text), pictures(shown(solid()))
    np.testing.assert_array_equal(np.asarray(one.convert("RGB")), np.asarray(other.convert("RGB")))
