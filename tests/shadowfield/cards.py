"""A lamp over a floor and level rectangles between: what several tests of shared rays look at."""

import numpy as np

from firstorder.shadowfield.rendering.lamp import lamp_frame
from firstorder.shadowfield.rendering.ray_table import trace_shadow_rays
from firstorder.shadowfield.rendering.sheared_filter import sheared_shadow

HIGH = 4.0
LAMP = lamp_frame((0.0, 0.0, HIGH), (0.0, 0.8, 0.0), (0.8, 0.0, 0.0))
SIDE, PIXEL = 24, 0.05
FENCE = tuple((z, (x, -9.0), (x + 0.12, 9.0)) for z in (2.0, 2.3) for x in np.arange(-2, 2, 0.3))
EDGE = (2.5, (-9.0, -9.0), (0.0, 9.0))  # hides the half of the room in which x < 0


def floor(side=SIDE, pixel=PIXEL):
    x = pixel * (np.arange(side) - 0.5 * (side - 1))
    X, Y = np.meshgrid(x, x, indexing="ij")
    return np.stack([X, Y, 0.0 * X], -1).reshape(-1, 3)


def cards(*rectangles):
    """Level rectangles (height, low corner, high corner) as `trace_shadow_rays` wants blockers."""

    def hidden(a, b):
        first, last = np.full(len(a), np.inf), np.full(len(a), -np.inf)
        for z, low, high in rectangles:
            t = (z - a[:, 2]) / (b[:, 2] - a[:, 2])
            p = a[:, :2] + t[:, None] * (b - a)[:, :2]
            hit = (t > 0.0) & (t < 1.0) & np.all((p >= low) & (p <= high), 1)
            first = np.where(hit, np.minimum(first, 1.0 - t), first)
            last = np.where(hit, np.maximum(last, 1.0 - t), last)
        return first, last

    return hidden


def fence_light(receivers, bars=None):
    """The share of the lamp that is seen past bars that run along y, the fence by default."""
    across = 0.8 * ((2.0 * np.arange(4096) + 1.0) / 4096 - 1.0)
    shares = {}
    for x in np.unique(receivers[:, 0]):
        hidden = np.zeros(len(across), bool)
        for z, low, high in FENCE if bars is None else bars:
            p = across + (HIGH - z) / HIGH * (x - across)
            hidden |= (p >= low[0]) & (p <= high[0])
        shares[x] = 1.0 - np.mean(hidden)
    return np.array([shares[x] for x in receivers[:, 0]])


def bad_receivers(right):
    """The floor, with three receivers put in that no lamp can light; the number of each row."""
    bad = [(np.nan, 0.0, 0.0), (0.0, 0.0, HIGH), (0.1, 0.1, HIGH + 0.5)]
    places = [30, 200, 400]
    return np.insert(right, places, bad, 0), places + np.arange(3)


def run(rays, *rectangles, Omega=1.5, seed=0, receivers=None, **options):
    receivers = floor() if receivers is None else receivers
    table, owner = trace_shadow_rays(LAMP, receivers, rays, cards(*rectangles), seed)
    own = np.bincount(owner, table.free, len(receivers)) / np.maximum(
        np.bincount(owner, minlength=len(receivers)), 1
    )
    return sheared_shadow(LAMP, table, receivers, Omega, PIXEL, own, **options), own
