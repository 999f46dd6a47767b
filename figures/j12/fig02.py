"""J12 Fig. 2: the four test scenes with their irradiance, and without occlusion (dotted).

The paper plots E; beside it are our E' and E''. Sizes are the library's
(`firstorder.flatland.library._scenes`). A and B are exact; C and D are the radiosity reference with
all bounces, and exact derivatives of it. §4.1 calls C's irradiance "completely smooth ...
differentiated many times". It is, between corners; at a corner E behaves as a + b x^0.90 and E'
diverges, so that the second half does not hold up to the walls' ends. The power is below 1 for
every albedo above 0. Where D's E' jumps is known in closed form (grey lines).
"""

from __future__ import annotations

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from figures.j12.shared.scenes import line_light
from figures.style import Drawing
from figures.verdicts import OURS, Measurement, Statement, at_least, at_most
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
ALBEDOS = (0.05, 0.2, 0.5, 0.8)  # for which the corner's power is told
CORNER = (1e-4, 2e-4, 4e-4)  # places beside it, each twice as far
LEAST = 1e-6  # of a jump of E', above rounding [W/m^2]
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
    jumps = {k: _jumps(lights[k]) for k in "ABD"}
    for row, k in enumerate("ABCD"):
        x = arrays[f"{k}_x"]
        plotting.draw_scene(axes[row, 0], scenes[k], normals=False, receivers=("floor",))
        axes[row, 0].set_title(k, loc="left")
        for order in range(3):
            ax = axes[row, order + 1]
            for at in jumps.get(k, np.zeros(0)) * x[-1] / s[-1]:
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


def _jumps(light) -> np.ndarray:
    """Where E' jumps along the floor, by its parameter: on many lines of edges it does not."""
    solved = isinstance(light, RadiositySolution)
    found = jumps_along(light.scene, 0, light) if solved else jumps_along(light, 0)
    return found.s[np.abs(found.jump_E1) > LEAST]


def _claims(lights, curves, corner, arrays, jumps) -> list[Statement | Measurement]:
    x = arrays["A_x"] - 1.0
    near = corner[:, 1]
    power = 1.0 + float(np.log2((near[2] - near[1]) / (near[1] - near[0])))  # E' = c + d x^(a - 1)
    return [
        _analytic("A", curves["A"][0] - line_light(x, False)),
        _analytic("B", curves["B"][0] - line_light(x, True)),
        Measurement("B: jumps of E' that occlusion makes on the floor", len(jumps["B"])),
        _smooth_between(lights["C"]),
        *_smooth_at_corners(power),
        Statement(
            "D: the occluders introduce discontinuities in the derivatives: jumps on the floor",
            paper="introduce discontinuities",
            measured=len(jumps["D"]),
            rule=at_least(1, "'introduce': there are some, and scene C has none"),
            source="J12 §4.1",
        ),
        _balanced(lights),
    ]


def _analytic(name: str, wrong) -> Statement:
    return Statement(
        f"{name}: irradiance can be computed analytically: largest distance from the closed form",
        paper="analytic",
        measured=float(np.max(np.abs(wrong))),
        rule=at_most(1e-12, "rounding in double precision"),
        source="J12 §4.1",
        unit="W/m",
    )


def _smooth_between(solution: RadiositySolution) -> Statement:
    return Statement(
        "C: no occlusion, so that irradiance is completely smooth between the corners: jumps of "
        "its derivatives",
        paper="completely smooth",
        measured=len(solution.events.s),
        rule=at_most(0, "'completely smooth'"),
        source="J12 §4.1",
    )


def _smooth_at_corners(power: float) -> list[Statement | Measurement]:
    apart = abs(corner_exponent(0.2) - power)
    powers = [corner_exponent(albedo) for albedo in ALBEDOS]
    return [
        Statement(
            "C: irradiance can be differentiated many times, up to the corners: power of the "
            "distance with which it leaves its value there",
            paper="many times",
            measured=power,
            rule=at_least(1.0, "below 1 not even E' exists there"),
            source="J12 §4.1",
            error=apart,
            reason="Walls at right angles reflect each other's rise: E = a + b x^p, rho m(p) = 1, "
            "so p < 1 and E' diverges at every corner for every albedo above 0. Between corners "
            "the paper is right.",
        ),
        Statement(
            "C: that power is the one of the corner's equation: their difference",
            paper=None,
            measured=apart,
            rule=at_most(0.05, "three places beside the corner resolve no more"),
            source=OURS,
        ),
        Measurement(
            f"Powers by the corner's equation at albedos {', '.join(f'{a:g}' for a in ALBEDOS)}",
            ", ".join(f"{p:.3f}" for p in powers),
        ),
    ]


def _balanced(lights) -> Statement:
    balance = [float(b / a) - 1.0 for a, b in (lights[k].flux() for k in "CD")]
    return Statement(
        "C and D: absorbed flux over emitted, less one",
        paper=None,
        measured=max(map(abs, balance)),
        rule=at_most(1e-4, "the solution's own error"),
        source=OURS,
    )
