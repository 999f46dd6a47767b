"""E11 Fig. 3: a light, blockers in a range of depths, a receiver, and the two names of a ray.

The paper gives no numbers. Ours: light and receiver 1 m long and d1 = 1 m apart, four strips and
two discs between 0.2 and 0.45 m below the light (`e11_fig03`). (b) names a ray by its place on
the light y and its offset v for each metre, which is the library's slope of incoming light; (c)
by its places on the receiver and on the light. A blocker at the depth d2 makes a band of slope
`dy/dx = -d2 / (d1 - d2)` in (c).
"""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from figures.e11.shared import scenes as e11
from figures.style import Claim, Drawing
from firstorder import plotting
from firstorder.flatland import Circles, Scene, primitive
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


def _claims(scene, both, grid) -> list[Claim]:
    rng = np.random.default_rng(3)
    x, y = rng.uniform(0.0, 1.0, (2, 2000))
    one = eqx.filter_jit(ray_visibility)(scene, x, y)
    other = eqx.filter_jit(ray_visibility_by_slope)(scene, y, x - y)
    differing = float(jnp.mean(one != other))
    slope = _band()
    inside = 1.0 - e11.leak(both, grid, Wedge(*FIG03_DEPTHS))
    return [
        Claim("rays of which the two names disagree", 0.0, differing, "share", differing == 0.0),
        Claim(
            "the band of a disc 0.35 m below the light has slope -d2 / (d1 - d2)",
            -0.35 / 0.65,
            slope,
            "m/m",
            abs(slope + 0.35 / 0.65) < 0.01,
        ),
        Claim(
            "energy of f, the mean apart, between the slopes of the two extreme depths",
            "most",
            inside,
            "share",
            inside > 0.9,
        ),
    ]


def _band() -> float:
    """Slope of the middle of what one disc hides, fitted to traced rays."""
    scene = Scene.of(primitive(Circles((0.5, 0.65), 0.05)))
    x, y = np.linspace(0.3, 0.7, 41), np.linspace(0.0, 1.0, 4001)
    hidden = 1.0 - np.asarray(eqx.filter_jit(ray_visibility)(scene, x[:, None], y))
    middle = hidden @ y / np.sum(hidden, axis=1)
    return float(np.polyfit(x, middle, 1)[0])
