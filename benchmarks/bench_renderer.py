"""What the renderer costs: pixels and shadow rays a second, the share of each part, and the floor.

Two scenes: shapes with surface maps under a lamp and a sky (432 nodes a pixel), and a mesh whose
shadow rays are Embree's. Times are those of the processor, the least of a few runs in turns. The
floor is what a node cannot do without: a ray test of each shape, some 140 operations, and for its
terms 190 more, by a core that does nothing but multiply matrices.
"""

import pathlib
import time

import numpy as np
import pytest

from firstorder.io import read_space
from firstorder.rendering.image_files import image_coordinates, world_from_scene
from firstorder.rendering.renderer import Renderer

EXAMPLES = pathlib.Path(__file__).parents[1] / "examples"
SIDE, REPEATS = 128, 3
OPERATIONS = 330  # a node, with its ray


def seconds(call):
    """Processor time of a call, over all threads."""
    begin = time.process_time()
    call()
    return time.process_time() - begin


def least(**calls):
    """Shortest of a few runs of each call, one after the other."""
    for call in calls.values():
        call()
    rounds = [{name: seconds(call) for name, call in calls.items()} for _ in range(REPEATS)]
    return {name: min(each[name] for each in rounds) for name in calls}


def product():
    """Operations a second of a matrix product, in double precision."""
    a = np.random.default_rng(0).random((1024, 1024))
    return 2.0 * 1024**3 / least(product=lambda: a @ a)["product"]


@pytest.mark.benchmark(group="renderer")
@pytest.mark.parametrize("scene", ["coats", "pebble"])
def test_renderer(capsys, scene):
    world = world_from_scene(read_space(EXAMPLES / f"{scene}.toml"))
    made = Renderer(world)
    x = np.arange(SIDE) + 0.5
    p = np.stack(np.meshgrid(x, x, indexing="ij"), -1).reshape(-1, 2)
    p = image_coordinates(p, SIDE, SIDE)
    seen = made.seen(p)
    lit = int(np.sum((seen.index >= 0) & (seen.index < world.shapes + len(world.models))))
    nodes = sum(int(np.prod(light.shape)) for light in made.lights)
    number = np.random.default_rng(0).random(lit * nodes) + 0.5
    spent = least(
        layers=lambda: made.layers(p),
        seen=lambda: made.seen(p),
        open=lambda: made.pixels(p, seen=seen, shadows=False),
        values=lambda: made.pixels(p, seen=seen, gradients=False),
        logarithms=lambda: np.log(number),
    )
    whole, unit = spent["layers"], spent["logarithms"]
    each = {name: spent[name] / whole for name in ("seen", "open", "values")}
    floor = OPERATIONS * lit * nodes / product()
    with capsys.disabled():
        print(
            f"\n{scene}: {len(p) / whole:,.0f} pixels and {lit * nodes / whole / 1e6:.1f} million "
            f"shadow rays a second of one core, all layers; of that time primary rays "
            f"{each['seen']:.1%}, without shadows {each['open']:.0%}, values alone "
            f"{each['values']:.0%}; {whole / unit:.1f} times a logarithm for each node, "
            f"{whole / floor:.0f} times the floor"
        )
    assert whole < {"coats": 150.0, "pebble": 450.0}[scene] * unit
