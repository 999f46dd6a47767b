r"""Soft shadows seen straight in a photon map: arriving photons over those that set out.

Photons leave places on the lamp, as dense as the light is bright, for places spread evenly over a
flat receiver. Without blockers they would arrive at a known density; the share that does arrive at
x is the share of the lamp that x sees:

    h(x) = (k - 1) / (pi r_k(x)^2 density),   r_k: distance of the k-th nearest photon

right on average where h is the same within r_k, for independent photons (`k` in place of `k - 1`
is too bright). It errs by ~ h / sqrt(k), and by a blur over r_k: only k that grows, and grows more
slowly than the number N of photons, takes both away. Where illumination is smooth the blur is
~ r_k^2 ~ k / N; the error is least for k ~ N^(2/3) and falls with N^(-1/3). Not so where a
penumbra's ends are in view, where its slope jumps: at the dark one, where h ~ d, the k nearest
photons reach r ~ (k/N)^(1/3) and a strip of that width is off by as much, a mean square of k/N
beside the noise's 1/k. Best is k ~ N^(1/2) there, and the error falls with N^(-1/4).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.spatial
from jaxtyping import Float

from figures.e11.competitors.baselines import CHUNK, Falloff, on_lamp
from firstorder._argument_checks import check_positive
from firstorder.shadowfield.rendering.lamp import LampFrame
from firstorder.shadowfield.rendering.ray_table import Blockers

SHARE = 0.35  # of N^(2/3) in `nearest`


class Photons(NamedTuple):
    """Photons on a flat receiver: 12 bytes each, for all have the same power.

    Attributes:
        position: where they arrived, from `corner`: single precision tells no small distances far
            from the origin of the world [m].
        density: at which they arrive where nothing hides the lamp [1/m^2].
        corner: of the parallelogram, in the world [m].
    """

    position: Float[np.ndarray, "n 3"]
    density: float
    corner: Float[np.ndarray, "3"]

    @property
    def places(self) -> Float[np.ndarray, "n 3"]:
        """Where they arrived, in the world [m]."""
        return self.corner + self.position

    @property
    def bytes_each(self) -> float:
        """Stored for a photon, without the tree that finds it."""
        return self.position.nbytes / max(len(self.position), 1)


def shoot(
    lamp: LampFrame,
    corner: Float[np.ndarray, "3"],
    edges: Float[np.ndarray, "2 3"],
    count: int,
    blockers: Blockers,
    seed: int = 0,
    falloff: Falloff | None = None,
) -> Photons:
    """Sends photons from the lamp to a parallelogram, and keeps those that arrive.

    Args:
        lamp: the lamp.
        corner: of the parallelogram [m]; it should reach farther than what is looked at, for
            photons end with it.
        edges: from that corner, as rows [m].
        count: of photons that leave.
        blockers: as `rays.trace` wants them.
        seed: of the random numbers.
        falloff: of the light, from places in [-1, 1]^2; None for a constant.

    Raises:
        ValueError: if no photon leaves, or the parallelogram has no area.

    Reference: E11 §6.1 and Fig. 9 (b), which looks at RenderMan's photon map.

    Example:
        >>> import numpy as np
        >>> from figures.e11.competitors.photons import shoot
        >>> from firstorder.shadowfield.rendering.lamp import lamp_frame
        >>> def nothing(a, b):
        ...     return np.full(len(a), np.inf), np.full(len(a), -np.inf)
        >>> lamp = lamp_frame((0, 0, 2), (0, 1, 0), (1, 0, 0))
        >>> found = shoot(lamp, np.zeros(3), np.array([(2.0, 0, 0), (0, 1.0, 0)]), 100, nothing)
        >>> found.position.shape, found.density, found.bytes_each
        ((100, 3), 50.0, 12.0)
    """
    check_positive("count", count)
    area = float(np.linalg.norm(np.cross(edges[0], edges[1])))
    check_positive("edges", area)
    rng = np.random.default_rng(seed)
    start, arrived = np.asarray(corner, float), []
    for begin in range(0, count, CHUNK):
        n = min(CHUNK, count - begin)
        places = rng.random((n, 2)) @ edges
        y = on_lamp(rng.random((n, 2)), falloff) * lamp.half
        first, _ = blockers(start + places, lamp.world(np.concatenate([y, np.zeros((n, 1))], 1)))
        arrived.append(places[np.isinf(first)].astype(np.float32))
    return Photons(np.concatenate(arrived), count / area, start)


def nearest(count: int) -> int:
    """How many photons to average, for so many that left: `~ count^(2/3)`, at least 8.

    Best where illumination is smooth; with the ends of penumbrae in view, too many of many.

    Example:
        >>> from figures.e11.competitors.photons import nearest
        >>> [nearest(n) for n in (100, 10**6)]
        [8, 3500]
    """
    check_positive("count", count)
    return max(round(SHARE * count ** (2.0 / 3.0)), 8)


def shares(
    photons: Photons, receivers: Float[np.ndarray, "m 3"], k: int
) -> Float[np.ndarray, " m"]:
    """The share of the lamp that each receiver sees, from the k nearest photons.

    Not cut to [0, 1]: it is a density over a density, and as often too high as too low.

    Args:
        photons: on the plane of the receivers.
        receivers: in the world [m].
        k: photons; all, if there are fewer.

    Raises:
        ValueError: if k is less than 2.

    Returns:
        Zeros if fewer than two photons arrived anywhere.
    """
    if k < 2:
        raise ValueError(f"Argument `k` must be at least 2, but is {k}.")
    k = min(k, len(photons.position))
    if k < 2:
        return np.zeros(len(receivers))
    tree = scipy.spatial.KDTree(photons.position)
    r, _ = tree.query(receivers - photons.corner, [k], workers=-1)
    return (k - 1.0) / (np.pi * np.square(r[:, 0]) * photons.density)


__all__ = ["Photons", "nearest", "shares", "shoot"]
