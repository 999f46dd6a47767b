"""E11 Fig. 3: a light, blockers in a range of depths, a receiver, and the two names of a ray.

The paper gives no numbers. Ours: light and receiver 1 m long and d1 = 1 m apart, four strips and
two discs between 0.2 and 0.45 m below the light (`e11_fig03`). (b) names a ray by its place on
the light y and its offset v for each metre, which is the library's slope of incoming light; (c)
by its places on the receiver and on the light. A blocker at the depth d2 makes a band of slope
`dy/dx = -d2 / (d1 - d2)` in (c): it is fitted to what a narrow strip hides at each of 12 depths.
"""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from figures.e11.shared import scenes as e11
from figures.style import Drawing
from figures.verdicts import Measurement, Statement, at_most
from firstorder import plotting
from firstorder.flatland import Scene, Segments, primitive
from firstorder.flatland.library._e11 import FIG03_DEPTHS, e11_fig03
from firstorder.shadowfield import Wedge, ray_visibility, ray_visibility_by_slope


def draw(quick: bool) -> Drawing:
    n = 96 if quick else 384
    scene, grid = e11_fig03(), e11.unit_grid(n)
    x, y = grid.axis(0), grid.axis(1)
    v = np.linspace(-1.0, 1.0, n + 1)
    both = np.asarray(e11.visibility(scene, grid))
    slopes = np.asarray(eqx.filter_jit(ray_visibility_by_slope)(scene, y, v[:, None]))
    figure, axes = plotting.panels(1, 3, 3.0, 2.7)
    e11.draw_map(axes[0, 0], scene, "a) scene", rays=[(0.2, 0.75), (0.2, 0.35), (0.2, 0.05)])
    plotting.show_light_field(
        axes[0, 1], slopes, v, y, limit=1.0, names=("v", "y"), title="b) f(v, y)"
    )
    plotting.show_light_field(
        axes[0, 2], both, x, y, limit=1.0, names=("x", "y"), title="c) f(x, y)"
    )
    arrays = {"x": x, "y": y, "v": v, "f_xy": both, "f_vy": slopes}
    return Drawing(figure, arrays, _claims(scene, both, grid), size=f"{n} x {n} rays")


def _claims(scene, both, grid) -> list[Statement | Measurement]:
    rng = np.random.default_rng(3)
    x, y = rng.uniform(0.0, 1.0, (2, 2000))
    one = eqx.filter_jit(ray_visibility)(scene, x, y)
    other = eqx.filter_jit(ray_visibility_by_slope)(scene, y, x - y)
    depths = np.linspace(0.15, 0.6, 12)
    off = [abs(_band(d) * (1.0 - d) / d + 1.0) for d in depths]
    inside = 1.0 - e11.leak(both, grid, Wedge(*FIG03_DEPTHS))
    return [
        Statement(
            "Rays are named by (v, y) or by (x, y): share of those of which the names disagree",
            "the same ray",
            float(jnp.mean(one != other)),
            at_most(0.0, "the same ray"),
            "E11 Fig. 3",
            scanned="2,000 rays at random",
        ),
        Statement(
            "Each occluder makes a diagonal band in (x, y): largest relative difference of its "
            "slope from -d2 / (d1 - d2)",
            "a diagonal band",
            float(np.max(off)),
            at_most(0.002, "the light is sampled every 1/4000 m, bands are followed for 0.3 m"),
            "E11 §3",
            scanned="a strip at 12 depths from 0.15 to 0.6 m",
        ),
        Measurement(
            "Energy of f, the mean apart, between the slopes of the two extreme depths",
            inside,
            "share",
            source="E11 §3.1",
        ),
    ]


def _band(depth: float) -> float:
    """Slope of the middle of what one narrow strip hides, fitted to traced rays."""
    middle = np.array([0.5, 1.0 - depth])
    across = np.array([0.02, 0.0])
    scene = Scene.of(primitive(Segments(middle - across, middle + across)))
    # Where its band stays on the light.
    reach = 0.3 * min(1.0, (1.0 - depth) / depth)
    x, y = np.linspace(0.5 - reach, 0.5 + reach, 41), np.linspace(0.0, 1.0, 4001)
    hidden = 1.0 - np.asarray(_traced(scene, x[:, None], y))
    middle = hidden @ y / np.sum(hidden, axis=1)
    return float(np.polyfit(x, middle, 1)[0])


_traced = eqx.filter_jit(ray_visibility)
