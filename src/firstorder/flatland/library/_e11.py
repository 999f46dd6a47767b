"""The blockers of E11's flatland figures, as scenes: a light above a floor, both one metre long.

The floor lies on y = 0 and faces up, the light on y = 1 and faces down, both for 0 <= x <= 1: E11's
x and y both run over [0, 1], at a distance d1 = 1. What stands at the depth d2 below the light has
the height 1 - d2. Shapes are named "floor", "light" and "blocker".
"""

from __future__ import annotations

import numpy as np

from firstorder.flatland.primitives import Primitive, primitive
from firstorder.flatland.scene import Scene
from firstorder.flatland.shapes.kinds import Circles, Segments

# Depths below the light between which the blockers of each figure stand [m].
FIG03_DEPTHS = (0.2, 0.45)
FIG07_DEPTHS = (0.1, 0.4)
FIG18_DEPTHS = (0.25, 0.5)


def e11_fig03() -> Scene:
    """A handful of thin and round blockers between two depths.

    Reference: E11 Fig. 3 (a); the paper gives no numbers.

    Example:
        >>> from firstorder.flatland.library._e11 import e11_fig03
        >>> len(e11_fig03().named("blocker"))
        6
    """
    thin = [
        ((0.10, 0.68), (0.24, 0.72)),
        ((0.43, 0.58), (0.52, 0.60)),
        ((0.70, 0.76), (0.84, 0.73)),
        ((0.88, 0.57), (0.99, 0.62)),
    ]
    start, end = np.array(thin).transpose(1, 0, 2)
    discs = primitive(
        Circles(np.array([[0.33, 0.73], [0.62, 0.65]]), np.array([0.04, 0.05])), name=_B
    )
    return Scene.of(*_light_and_floor(), primitive(Segments(start, end), name=_B), discs)


def e11_fig07(seed: int = 7, thin: int = 18, round: int = 12) -> Scene:
    """Thin and round blockers at random places and in random orientations, near the light.

    All of each blocker lies between the depths `FIG07_DEPTHS`, and its middle over the light.

    Args:
        seed: of the random numbers.
        thin: how many are segments, 4 to 10 cm long.
        round: how many are discs, of radius 0.8 to 2.5 cm.

    Raises:
        ValueError: if there is no blocker of a kind.

    Reference: E11 Fig. 7 (a); the paper gives no numbers.

    Example:
        >>> from firstorder.flatland.library._e11 import e11_fig07
        >>> len(e11_fig07(seed=1).named("blocker"))
        30
    """
    for name, count in (("thin", thin), ("round", round)):
        if count < 1:
            raise ValueError(f"Argument `{name}` must be positive, but is {count}.")
    rng = np.random.default_rng(seed)
    low, high = 1.0 - FIG07_DEPTHS[1], 1.0 - FIG07_DEPTHS[0]
    angle, length = rng.uniform(0.0, np.pi, thin), rng.uniform(0.04, 0.10, thin)
    half = 0.5 * length[:, None] * np.stack([np.cos(angle), np.sin(angle)], -1)
    middle = _places(rng, np.abs(half[:, 1]), low, high)
    radius = rng.uniform(0.008, 0.025, round)
    discs = Circles(_places(rng, radius, low, high), radius)
    strips = Segments(middle - half, middle + half)
    return Scene.of(*_light_and_floor(), primitive(strips, name=_B), primitive(discs, name=_B))


def e11_fig18a(period: float = 0.125) -> Scene:
    """The double slit: two combs whose bars and gaps are in proportion to their height.

    From the floor both combs cover the light with one common period, so that together they pass
    anything from half of it to none, in a triangle wave along the floor that is the finer the finer
    the combs are, and no weaker.

    Args:
        period: with which the combs cover the light [m].

    Raises:
        ValueError: if `period` is not positive or leaves no whole gap.

    Reference: E11 Fig. 18 (a), §7.

    Example:
        >>> from firstorder.flatland.library._e11 import e11_fig18a
        >>> len(e11_fig18a(0.25).named("blocker"))
        14
    """
    if not 0.0 < period <= 0.5:
        raise ValueError(f"Argument `period` must lie in (0, 0.5], but is {period}.")
    starts, ends = [], []
    for depth in FIG18_DEPTHS:
        height = 1.0 - depth
        p = period * height
        middles = p * (np.arange(int(np.ceil(1.0 / p)) + 1) + 0.5)
        middles = middles[middles - 0.25 * p < 1.0]
        for way, where in ((-0.25, starts), (0.25, ends)):
            where.append(np.stack([middles + way * p, np.full_like(middles, height)], -1))
    bars = Segments(np.concatenate(starts), np.concatenate(ends))
    return Scene.of(*_light_and_floor(), primitive(bars, name=_B))


def e11_fig18b(walls: int = 17, middle: float = 0.5) -> Scene:
    """The funnel: thin walls that all point at one place on the floor.

    From there they are seen edge-on and hide nothing; a little beside it they overlap and hide the
    light: at a distance s from the place the light is seen by `max(0, 1 - (2/3) walls |s|)`. More
    walls make a narrower spike of the same height.

    Args:
        walls: how many stand before the light; more on either side darken the rest of the floor.
        middle: where they point, in [0, 1] [m].

    Raises:
        ValueError: if there are fewer than two walls, or `middle` is not on the floor.

    Reference: E11 Fig. 18 (b), §7.

    Example:
        >>> from firstorder.flatland.library._e11 import e11_fig18b
        >>> len(e11_fig18b(9).named("blocker"))
        27
    """
    if walls < 2:
        raise ValueError(f"Argument `walls` must be at least 2, but is {walls}.")
    if not 0.0 <= middle <= 1.0:
        raise ValueError(f"Argument `middle` must lie in [0, 1], but is {middle}.")
    place = (np.arange(-walls, 2 * walls) + 0.5) / walls
    top = np.stack([place, np.ones_like(place)], -1)
    foot = np.array([middle, 0.0])
    start, end = (foot + (1.0 - depth) * (top - foot) for depth in FIG18_DEPTHS)
    return Scene.of(*_light_and_floor(), primitive(Segments(start, end), name=_B))


_B = "blocker"


def _light_and_floor() -> tuple[Primitive, Primitive]:
    """The floor faces up, the light down (conventions: normals on the left)."""
    floor = primitive(Segments((0.0, 0.0), (1.0, 0.0)), name="floor")
    return floor, primitive(Segments((1.0, 1.0), (0.0, 1.0)), name="light", emission=1.0)


def _places(rng, reach: np.ndarray, low: float, high: float) -> np.ndarray:
    """Middles over the light such that what reaches up and down by `reach` stays in between."""
    height = rng.uniform(low + reach, high - reach)
    return np.stack([rng.uniform(0.02, 0.98, reach.size), height], -1)
