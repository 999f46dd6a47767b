"""Lay-outs like J12 Fig. 14: a lamp over a floor, beside a white wall, a black one, or none.

The floor is y = 0 from x = 0 to 2 m, the wall stands at its left end. Lamp and wall have other
places and sizes in each; all but the white wall is black, so that one bounce is all there is.
Irradiance and the lengths of rays are written out for this arrangement.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from figures.j12.shared.caching import Asked, compare, limits, pointwise, split
from firstorder.caching import Candidates, harmonic_mean_distance, minimum_distance
from firstorder.numerics._quadrature import gauss_legendre

WALLS = ("white", "black", "none")
SPLIT, HESSIAN = ("minimum", "harmonic mean"), "Hessian"
DEFINITIONS = ("average", "integrated squared", "relative")
WIDTHS = (0.1, 0.2, 0.4, 0.8)  # of the lamp [m]
LENGTH, RAYS = 2.0, 512


class Layout(NamedTuple):
    """The lamp's ends and height, and the height of the wall [m]."""

    left: float
    right: float
    height: float
    wall: float


def layouts(count: int, seed: int) -> list[Layout]:
    """Lamps of all widths in turn, anywhere over the floor; walls that never shadow them."""
    rng, found = np.random.default_rng(seed), []
    for i in range(count):
        width = WIDTHS[i % len(WIDTHS)]
        left, height = rng.uniform(0.05, LENGTH - width), rng.uniform(0.6, 1.4)
        found.append(Layout(left, left + width, height, rng.uniform(0.3, height)))
    return found


def errors(layout: Layout, wall: str, count: int, orders: int) -> dict[str, float]:
    """Mean RMS error of each method's caches of 20 records, over orders of insertion."""
    x = LENGTH * (np.arange(count) + 0.5) / count
    dense = LENGTH * (np.arange(2 * count) + 0.3183) / (2 * count)
    share = 1.0 if wall == "white" else 0.0
    E, first, second = (np.asarray(a) for a in _jet(layout, share, x))
    t = _lengths(layout, wall != "none", x)
    candidates = Candidates.of(
        x,
        E,
        first[:, None],
        second[:, None, None],
        minimum=minimum_distance(t),
        harmonic=harmonic_mean_distance(t),
    )
    held, bend = limits(LENGTH, count), second[:, None, None]
    methods = {
        "minimum": split(candidates.minimum, held),
        "harmonic mean": split(candidates.harmonic, held),
        HESSIAN: pointwise(bend, held),
        **{name: pointwise(bend, held, definition=name, value=E) for name in DEFINITIONS},
    }
    asked = Asked(dense[:, None], np.asarray(_jet(layout, share, dense)[0]))
    return {name: o.mean for name, o in compare(candidates, methods, asked, orders).items()}


@jax.jit
def _jet(layout: Layout, share, x):
    """E and two derivatives at places of the floor, the wall reflecting a share of its light."""

    def E(x):
        return _direct(layout, x) + 0.5 * share * _from_wall(layout, x)

    def slope(x):
        return jax.jvp(E, (x,), (jnp.ones_like(x),))

    (value, first), (_, second) = jax.jvp(slope, (x,), (jnp.ones_like(x),))
    return value, first, second


def _direct(layout: Layout, x):
    """The lamp alone: differences of sines."""
    u, v = layout.right - x, layout.left - x
    h = layout.height
    return u / jnp.sqrt(u * u + h * h) - v / jnp.sqrt(v * v + h * h)


def _from_wall(layout: Layout, x):
    """What the wall sends: its irradiance times `x y / r^3`, on pieces that halve to the corner."""
    t, w = gauss_legendre(16)
    top = layout.wall * 2.0 ** -jnp.arange(14.0)
    low = jnp.append(top[1:], 0.0)
    y = 0.5 * (top + low)[:, None] + 0.5 * (top - low)[:, None] * t
    below = layout.height - y
    sent = below / jnp.hypot(layout.left, below) - below / jnp.hypot(layout.right, below)
    kernel = x[:, None, None] * y / (x[:, None, None] ** 2 + y * y) ** 1.5
    return jnp.sum(0.5 * (top - low)[:, None] * w * sent * kernel, axis=(1, 2))


def _lengths(layout: Layout, wall: bool, x: np.ndarray) -> np.ndarray:
    """Lengths of rays of equal cosine weight; infinite where one meets nothing [m]."""
    s = -1.0 + (2.0 * np.arange(RAYS) + 1.0) / RAYS
    up = np.sqrt(1.0 - s * s)
    to_lamp = np.broadcast_to(layout.height / up, (len(x), RAYS))
    at = x[:, None] + to_lamp * s
    t = np.where((at >= layout.left) & (at <= layout.right), to_lamp, np.inf)
    to_wall = np.where(s < 0.0, x[:, None] / np.where(s < 0.0, -s, 1.0), np.inf)
    met = wall & (to_wall * up <= layout.wall)
    return np.minimum(t, np.where(met, to_wall, np.inf))
