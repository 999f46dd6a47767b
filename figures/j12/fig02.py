"""J12 Fig. 2: the four test scenes with their irradiance, and without occlusion (dotted).

The paper plots E; beside it are our E' and E''. Sizes are the library's
(`firstorder.flatland.library._scenes`). A and B are exact; C and D are the radiosity reference with
all bounces, and exact derivatives of it. §4.1 calls C's irradiance "completely smooth ...
differentiated many times". It is, between corners; at a corner E behaves as a + b x^0.90 and E'
diverges, so that this claim does not hold up to the walls' ends. Where D's E' jumps is known in
closed form (grey lines).
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from figures.style import Claim, Drawing
from firstorder import plotting
from firstorder.flatland import Scene, irradiance, receiver
from firstorder.flatland.bounces._panels import Discretization
from firstorder.flatland.bounces.radiosity import (
    RadiositySolution,
    corner_exponent,
    solve_radiosity,
)
from firstorder.flatland.discontinuities.events import jumps_on as jumps_along
from firstorder.flatland.library._scenes import named_scene
from firstorder.numerics._batching import in_batches

COLORS = ("#b91c1c", "#15803d", "#1d4ed8")
CORNER = (1e-4, 2e-4, 4e-4)  # places beside it, each twice as far
WORDS = ("$E$ (W/m)", "$E'$ (W/m$^2$)", "$E''$ (W/m$^3$)")


@eqx.filter_jit
def jets(light, s):
    """E, E' and E'' along the first shape of a scene, or of a solution, in its parameter."""
    scene = light.scene if isinstance(light, RadiositySolution) else light

    def E(t):
        at = receiver(scene, 0, t)
        return (
            light.irradiance(at) if isinstance(light, RadiositySolution) else irradiance(scene, at)
        )

    def first(t):
        return jax.jvp(E, (t,), (jnp.ones_like(t),))

    def both(t):
        (value, slope), (_, bend) = jax.jvp(first, (t,), (jnp.ones_like(t),))
        return jnp.stack([value, slope, bend])

    return in_batches(both, s, 64)


def draw(quick: bool) -> Drawing:
    n = 81 if quick else 401
    fineness = Discretization(4, 1e-2) if quick else Discretization(8, 1e-6)
    scenes = {k: named_scene(f"scene_{k.lower()}") for k in "ABCD"}
    lights: dict[str, Scene | RadiositySolution] = dict(scenes)
    lights["C"] = solve_radiosity(
        scenes["C"], fineness=Discretization(6, 1e-6) if quick else fineness
    )
    lights["D"] = solve_radiosity(scenes["D"], fineness=fineness)
    figure, axes = plotting.panels(4, 4, 2.9, 2.1)
    arrays, s = {}, (np.arange(n) + 0.5) / n
    curves, corner = {}, {}
    for k in "ABCD":
        length = float(scenes[k].length(0))
        scale = length ** -np.arange(3.0)
        # The places beside a corner at once with all others: compiling takes longer.
        found = np.asarray(jets(lights[k], jnp.asarray(np.append(s, CORNER))))
        curves[k], corner[k] = scale[:, None] * found[:n].T, found[n:]
        arrays |= {f"{k}_x": length * s, f"{k}_jets": curves[k]}
    jumps = {k: jumps_along(scenes[k], 0) for k in "AB"}
    solution = lights["D"]
    assert isinstance(solution, RadiositySolution)
    events = solution.events.take((solution.events.receiver == 0) & solution.events.front)
    for row, k in enumerate("ABCD"):
        x = arrays[f"{k}_x"]
        plotting.draw_scene(axes[row, 0], scenes[k], normals=False, receivers=("floor",))
        axes[row, 0].set_title(k, loc="left")
        lines = jumps[k].s if k in jumps else (events.s if k == "D" else ())
        for order in range(3):
            ax = axes[row, order + 1]
            for at in np.asarray(lines) * x[-1] / s[-1]:
                ax.axvline(at, color="0.88", linewidth=0.5, linestyle="-")
            bare = curves["A" if k in "AB" else "C"][order]
            ax.plot(x, curves[k][order], color=COLORS[order], linestyle="-", linewidth=1.1)
            ax.plot(x, bare, color=COLORS[order], linestyle=":", linewidth=1.0)
            ax.set_title(WORDS[order] if row == 0 else "", loc="left")
            inner = np.concatenate([curves[k][order], bare])
            low, high = np.quantile(inner, [0.01, 0.99])
            pad = 0.15 * (high - low)
            ax.set_ylim(low - pad, high + pad)
        axes[row, 3].set_xlabel("$x$ (m)" if row == 3 else "")
    return Drawing(
        figure, arrays, _claims(lights, curves, corner["C"], arrays, jumps), size=f"{n} receivers"
    )


def _claims(lights, curves, corner, arrays, jumps) -> list[Claim]:
    x = arrays["A_x"] - 1.0
    by_hand = sum(sign * (e - x) / np.hypot(e - x, 1.0) for e, sign in ((0.5, 1), (-0.5, -1)))
    error = float(np.abs(curves["A"][0] - by_hand).max())
    near = corner[:, 1]
    power = 1.0 + float(np.log2((near[2] - near[1]) / (near[1] - near[0])))  # E' = c + d x^(a - 1)
    balance = [float(b / a) - 1.0 for a, b in (lights[k].flux() for k in "CD")]
    return [
        Claim("A: irradiance is analytic", 0.0, error, "W/m", error < 1e-12),
        Claim("B: jumps of E' that occlusion makes", None, len(jumps["B"].s), "", None),
        Claim(
            "C: completely smooth: power of x with which E leaves its value at a corner",
            "1, 2, ...",
            power,
            "",
            False,
        ),
        Claim(
            "C: that power by the corner's equation, less the measured one",
            0.0,
            abs(corner_exponent(0.2) - power),
            "",
            abs(corner_exponent(0.2) - power) < 0.05,
        ),
        Claim(
            "D: occluders introduce discontinuities in the derivatives: visual events on the floor",
            "yes",
            int(np.sum(lights["D"].events.receiver == 0)),
            "",
            bool(np.any(lights["D"].events.receiver == 0)),
        ),
        Claim(
            "C and D: absorbed flux over emitted, less one",
            0.0,
            max(map(abs, balance)),
            "",
            max(map(abs, balance)) < 1e-4,
        ),
    ]
