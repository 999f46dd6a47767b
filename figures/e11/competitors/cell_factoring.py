r"""What shading times visibility in each cell of a lamp leaves out of a shadow, at most.

With `g = K rho` the reflected radiance of a unit of light, W_c the light of a cell, V_c the share
of it that is seen, and r_c the mean of g over it (see `glossy_receivers`), two bounds, both ours:

    |error| <= (1/2) sum_c int_c |l g - r_c l| dy          reached by the worst blocker
    |error| <= sum_c W_c std_c(g) sqrt(V_c (1 - V_c))      for blockers that leave V_c
"""

from __future__ import annotations

import numpy as np

from firstorder._argument_checks import check_positive, check_shape
from firstorder.shadowfield.rendering._glossy_receivers import (
    Cells,
    Falloff,
    GlossySurface,
    Numbers,
    Points,
    integrand,
)
from firstorder.shadowfield.rendering.lamp import LampFrame


def worst_factoring(
    lamp: LampFrame,
    receivers: Points,
    surface: GlossySurface,
    cells: int = 1,
    falloff: Falloff | None = None,
    nodes: int = 32,
) -> Numbers:
    """Largest error of shading times visibility in each cell, over all blockers.

        (1/2) sum_c int_c |l K rho - r_c l| dy,    r_c = int_c l K rho dy / int_c l dy

    The visibility of a cell is the share of its *light* that is seen. `int_c (l K rho - r_c l)` is
    0, so that the worst blocker lets through where `K rho > r_c`: the bound is reached.

    Args:
        lamp: the lamp.
        receivers: in the world [m].
        surface: what they reflect.
        cells: along each edge of the lamp; 1 for E11's factoring.
        falloff: radiance over the lamp, from places in [-1, 1]^2; None for 1.
        nodes: of the midpoint rule along each edge of a cell; kinks leave it at order 2.

    Reference: E11 §3 ("a common approximation"); in flatland, `factoring_bound`.

    Example:
        >>> import numpy as np
        >>> from firstorder.shadowfield.rendering import _glossy_receivers as gr
        >>> from figures.e11.competitors.cell_factoring import worst_factoring
        >>> from firstorder.shadowfield.rendering.lamp import lamp_frame
        >>> lamp = lamp_frame((0, 0, 2), (0, 1, 0), (1, 0, 0))
        >>> up = np.array([[0.0, 0.0, 1.0]])
        >>> mirror = gr.glossy_surface(up, up, specular=1.0, exponent=50.0)
        >>> whole = gr.cell_light(lamp, 0 * up, mirror, 8).sum()
        >>> [round(float(worst_factoring(lamp, 0 * up, mirror, c)[0] / whole), 2)
        ...  for c in (1, 8)]
        [0.61, 0.14]
    """
    off = [
        np.abs(excess).sum((1, 2, 3, 4))
        for excess, _ in _excesses(lamp, receivers, surface, cells, falloff, nodes)
    ]
    return 0.5 * _node_area(lamp, cells, nodes) * np.concatenate(off)


def likely_factoring(
    lamp: LampFrame,
    receivers: Points,
    surface: GlossySurface,
    seen: Cells,
    falloff: Falloff | None = None,
    nodes: int = 32,
) -> Numbers:
    """Largest error of shading times visibility for blockers that leave known shares of cells.

        sum_c W_c std_c(K rho) sqrt(V_c (1 - V_c)),    W_c = int_c l dy

    The mean of a product is off the product of means by a covariance, which is no larger than both
    standard deviations; visibility is 0 or 1.

    Args:
        lamp: the lamp.
        receivers: in the world [m].
        surface: what they reflect.
        seen: share of each cell's light that is seen, in `gather`'s order.
        falloff: radiance over the lamp, from places in [-1, 1]^2; None for 1.
        nodes: of the midpoint rule along each edge of a cell.

    Raises:
        ValueError: if the number of cells is no square.
    """
    seen = np.asarray(seen, float)
    cells = round(np.sqrt(seen.shape[1]))
    check_shape("seen", seen, (len(receivers), cells**2))
    spread = [
        np.sqrt((excess**2 / light).sum((2, 4)) * light.sum((1, 3)))
        for excess, light in _excesses(lamp, receivers, surface, cells, falloff, nodes)
    ]
    std = np.concatenate(spread).reshape(len(seen), -1)
    both = std * np.sqrt(np.maximum(seen * (1.0 - seen), 0.0))
    return _node_area(lamp, cells, nodes) * np.sum(both, 1)


def _excesses(lamp, receivers, surface, cells: int, falloff, nodes: int):
    """`l K rho - r_c l` at midpoints, and l; a hair of light where there is none."""
    check_positive("nodes", nodes)
    g = (2.0 * np.arange(nodes) + 1.0) / nodes - 1.0
    for value, light in integrand(lamp, receivers, surface, cells, g, falloff):
        light = np.maximum(light, 1e-300)
        mean = (value * light).sum((2, 4), keepdims=True) / light.sum((1, 3), keepdims=True)
        yield (value - mean) * light, light


def _node_area(lamp: LampFrame, cells: int, nodes: int) -> float:
    """Of the lamp, for each node [m^2]."""
    return 4.0 * float(np.prod(lamp.half)) / (cells * nodes) ** 2


__all__ = ["likely_factoring", "worst_factoring"]
