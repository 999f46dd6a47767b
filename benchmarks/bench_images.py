"""What sampling an image costs beside shading it: the quad-tree, batched and one square at a time.

The tree's own time is what is left when that of the shading function is taken off. It should be at
most 2 us a sample on an idle core; the strict order stands beside it, and heaps of Python's own.
"""

import heapq
import time

import numpy as np
import pytest

from firstorder.reconstruction.importance import ShadedSamples
from firstorder.reconstruction.quadtree import sample_image

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
