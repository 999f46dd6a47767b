"""A light rig for pictures: a warm key, a cool fill from all around, and a rim from behind."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from firstorder._argument_checks import (
    check_coordinates,
    check_finite,
    check_integer,
    check_not_negative,
    check_positive,
)
from firstorder._display import in_print
from firstorder.imaging._lamps import Lamp
from firstorder.space.skies import ConstantSky

WARM, COOL = (1.16, 0.97, 0.78), (0.80, 0.99, 1.45)  # linear, of luminance 1


class LightRig(NamedTuple):
    """Light for a `World`.

    Attributes:
        lamps: key and rim.
        sky: the fill.
    """

    lamps: tuple[Lamp, ...]
    sky: ConstantSky

    __repr__ = in_print


def light_rig(
    center: Any, size: float, toward_eye: Any, *, nodes: int = 8, fill: float = 0.12,
    rim: float = 0.5, softness: float = 0.35,
) -> LightRig:  # fmt: skip
    """Three lights around a thing, as portraits have them, in three bands.

    A white diffuse surface at the middle that faces the key has the radiance 1; of this the fill
    is `fill`, from everywhere, and the rim `rim` where it is faced. That is to first order in
    `softness`: lamps are taken for points. The key stands 40 degrees left of the eye and 50 up, the
    rim opposite and 35 up; both are three sizes away.

    Args:
        center: of the thing [m].
        size: of the thing: radius of a ball around it [m].
        toward_eye: where the eye is from there, shape (3,); its length is of no matter.
        nodes: of a lamp, along each edge.
        fill: radiance of the sky; 0 or more.
        rim: light of the rim; 0 for none.
        softness: half of a lamp's edge over its distance.

    Raises:
        ValueError: if the eye is straight above or below, a vector is none, or a number is not
            positive, `fill` and `rim` below 0.

    Example:
        >>> from firstorder.rendering import light_rig
        >>> rig = light_rig((0, 0, 0.5), 1.0, (0, -1, 0))
        >>> [round(x, 2) for x in rig.lamps[0].center.tolist()]
        [-1.24, -1.48, 2.8]
    """
    check_integer("nodes", nodes)
    for name, number in (("size", size), ("nodes", nodes), ("softness", softness)):
        check_positive(name, number)
    for name, place in (("center", center), ("toward_eye", toward_eye)):
        check_coordinates(name, place)
        check_finite(name, place)
    check_not_negative("fill", fill)
    check_not_negative("rim", rim)
    middle = np.asarray(center, float)
    ahead = np.array([*np.asarray(toward_eye, float)[:2], 0.0])
    if not np.any(ahead):
        raise ValueError("Argument `toward_eye` must not be vertical, but is.")
    lamps = [_lamp(middle, 3.0 * size, ahead, -40.0, 50.0, softness, np.array(WARM), nodes)]
    if rim > 0.0:
        colour = rim * np.array(COOL)
        lamps.append(_lamp(middle, 3.0 * size, ahead, 140.0, 35.0, softness, colour, nodes))
    return LightRig(tuple(lamps), ConstantSky(fill * np.array(COOL)))


def _lamp(middle, distance, ahead, turn, up, softness, white, nodes) -> Lamp:
    """A square lamp that faces the middle: `turn` to the right of the eye, `up`, in degrees."""
    a, b = np.arctan2(ahead[1], ahead[0]) + np.radians(turn), np.radians(up)
    toward = np.array([np.cos(a) * np.cos(b), np.sin(a) * np.cos(b), np.sin(b)])
    across = np.array([-np.sin(a), np.cos(a), 0.0]) * softness * distance
    over = np.cross(toward, across)
    # Irradiance pi at the middle: L (2 h)^2 / d^2.
    radiance = np.pi * white / (2.0 * softness) ** 2
    return Lamp(middle + distance * toward, over, across, radiance, nodes, True)
