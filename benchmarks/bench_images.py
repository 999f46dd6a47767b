"""What sampling an image costs beside shading it, and what a gradient costs beside a value.

The quad-tree is timed batched and one square at a time; its triangles beside Delaunay's; value and
gradient of pixels with shadow rays by Embree beside the value, and beside all terms told apart.

The tree's own time is what is left when that of the shading function is taken off. It should be at
most 2 us a sample on an idle core; the strict order stands beside it, and heaps of Python's own.
"""

import heapq
import time

import numpy as np
import pytest

from firstorder import session
from firstorder.imaging import Lamp, pinhole
from firstorder.io.scenes.space_toml import MeshModel
from firstorder.models.primitives import bumpy_sphere, displaced_ground, place_mesh
from firstorder.reconstruction import delaunay_image, quadtree_image
from firstorder.reconstruction.importance import ShadedSamples
from firstorder.reconstruction.quadtree import sample_image
from firstorder.rendering import Renderer, World

SIDE, BUDGET, REPEATS = 512, 44_564, 7


def rings(p):
    """A picture with rings that grow finer, and its gradient."""
    x = (p - 256.0) / 64.0
    r2 = np.sum(x * x, 1)
    s, fade = np.sin(3.0 * r2), np.exp(-0.25 * r2)
    return ShadedSamples(
        fade * s, 2.0 * (fade * (3.0 * np.cos(3.0 * r2) - 0.25 * s))[:, None] * x / 64.0
    )


def tree_time(batch, repeats):
    """Microseconds a sample, without shading: the best of a few runs."""

    def shade(p):
        begin = time.perf_counter()
        found = rings(p)
        spent.append(time.perf_counter() - begin)
        return found

    best = np.inf
    for _ in range(repeats):
        spent = []
        begin = time.perf_counter()
        found = sample_image(shade, SIDE, SIDE, BUDGET, batch=batch)
        best = min(best, (time.perf_counter() - begin - sum(spent)) / len(found.p))
    return 1e6 * best


def heap_time():
    """Microseconds a sample of pushing every square and popping those that are split."""
    importance = np.random.default_rng(0).random(BUDGET).tolist()
    begin = time.perf_counter()
    heap = []
    for k, value in enumerate(importance):
        heapq.heappush(heap, (-value, k))
        if k % 4 == 3:
            heapq.heappop(heap)
    return 1e6 * (time.perf_counter() - begin) / BUDGET


@pytest.mark.benchmark(group="images")
def test_tree(capsys):
    batched, strict, heap = tree_time(0.03, REPEATS), tree_time(0.0, 1), heap_time()
    with capsys.disabled():
        print(f"\ntree: {batched:.2f} us a sample in batches, {strict:.1f} one square at a time; "
              f"a heap's pushes and pops alone {heap:.2f}")  # fmt: skip
    assert batched < 2.0


def seconds(run, repeats=REPEATS):
    """Processor time, the median of a few runs after one."""
    run()
    spent = []
    for _ in range(repeats):
        begin = time.process_time()
        run()
        spent.append(time.process_time() - begin)
    return float(np.median(spent))


@pytest.mark.benchmark(group="images")
def test_triangles_of_the_tree_beside_delaunays(capsys):
    found = sample_image(rings, SIDE, SIDE, BUDGET, smallest=1.0)
    given = (found.p, found.value, SIDE, SIDE)
    ours = seconds(lambda: quadtree_image(found, SIDE, SIDE), 3)
    theirs = seconds(lambda: delaunay_image(*given, gradient=found.gradient), 3)
    with capsys.disabled():
        us = 1e6 / SIDE**2
        print(f"\nimage: {us * ours:.2f} us a pixel over the tree's triangles, "
              f"{us * theirs:.2f} over Delaunay's")  # fmt: skip
    assert ours < 0.3 * theirs


@pytest.mark.benchmark(group="images")
@pytest.mark.parametrize(("nodes", "pixels"), [(8, 4096), (32, 1024)])
def test_a_gradient_beside_its_value(nodes, pixels, capsys):
    session.start(cache="off")
    matter = dict(albedo=0.5, specular=0.2, exponent=20.0)
    ball = place_mesh(bumpy_sphere(0.5, lambda v: 0.0 * v[:, 0], 5), (0.0, 0.0, 0.5))
    parts = {"floor": displaced_ground(4.0, cells=1), "ball": ball}
    models = tuple(MeshModel(one, name, matter) for name, one in parts.items())
    lamp = Lamp((-1.0, -1.5, 2.5), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0), 8.0, nodes, even=True)
    made = Renderer(
        World(pinhole((0.0, -4.0, 2.0), (0.0, 0.0, 0.4), gamma=2.4), None, models, (lamp,))
    )
    p = np.random.default_rng(0).uniform(-1.0, 1.0, (pixels, 2))
    seen = made.seen(p)
    value, both, terms = (
        1e6 / pixels * seconds(run)
        for run in (
            lambda: made.radiance(p, seen=seen, gradients=False),
            lambda: made.radiance(p, seen=seen),
            lambda: made.pixels(p, seen=seen),
        )
    )
    with capsys.disabled():
        print(f"\n{nodes} x {nodes} shadow rays: {value:.1f} us a value, {both / value:.2f} times "
              f"that with its gradient, {terms / value:.2f} with all terms")  # fmt: skip
    assert both < 0.7 * terms
