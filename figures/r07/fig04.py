"""R07 Fig. 4: which gradient term matters when, measured over lay-outs of each row.

The paper's table says "low" and "high" and leaves "normal" blank, without numbers. Each row is
measured in 256 lay-outs: a hill of radius 0.5 to 2 m, a Gaussian lobe of 0.1 to 0.3 rad, a line of
light 0.1 to 0.5 wide in slope (standard deviation) that shines the same in all directions, about a
slope of -0.7 to 0.7, seen within 0.2 rad of its mirror direction at the top of the hill. Each term
is the root mean square over 0.8 m of surface. "Normal" is the same lay-out with the light at 2 m.
Near is half the hill's radius, where by R07 §5.2 SV and CDV are of one size; far is 50 m; an
environment is without end. *Low* is below a fifth of normal, *high* above three times it (geometric
means of ratios), zero below 1e-12. `B_x = CDV` (or another sum) holds if what is left over is below
a tenth. Each row changes one thing: the light (none that varies in x; a sky `1 + sin(theta) / 20`),
the curvature (bumps of up to 20 per metre, or none), the lobe (0.02 rad for the mirror; Lambert's).
CV and CDV are the paper's, with 2 n_x for every lobe. The last claim, on textures, is of R07 §4.3:
an albedo `1 + sin / 2` of 2 to 20 cycles per metre on a Lambertian hill.

`B_x = SV + CDV` does not hold for Lambert's lobe: it turns with the normal once, so the curvature
term is `n_x L_theta (*) rho`, and with the paper's 2 n_x the sum misses B_x. Nor does `B_x = CDV`
for a mirror near the light: a sharper lobe raises SV as much as CDV.
"""

from __future__ import annotations

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure

from figures.spread import Spread, geometric, spread
from figures.style import Drawing
from figures.verdicts import REFUTED, Measurement, Statement, at_least, at_most
from firstorder import plotting
from firstorder.fields import Affine, Function
from firstorder.transport.brdf.lobes import glossy, lambert
from firstorder.transport.events.texture import wave
from firstorder.transport.shading.surface import Surface

MIDDLE, FAR, HALF, SEED = 2.0, 50.0, 0.4, 4
WAVES = 8.0  # of the bump map [cycles/m]
TERMS = ("SV", "DV", "CV", "CDV", "B_x")
UNITS = ("1/m", "1/rad", "rad/m", "1/m", "1/m")
LOW, HIGH, LEFT, ZERO = 0.2, 3.0, 0.1, 1e-12
NODES = 160
SOURCE = "R07 Fig. 4"


class Layout(NamedTuple):
    """What the paper leaves open, numbers or arrays of them.

    Attributes:
        width: standard deviation of the light, in slope.
        slope: its middle.
        radius: of the hill [m].
        lobe: standard deviation of a glossy lobe [rad].
        off: how far from the mirror direction it is seen [rad].
    """

    width: np.ndarray
    slope: np.ndarray
    radius: np.ndarray
    lobe: np.ndarray
    off: np.ndarray


def layouts(count: int) -> Layout:
    """At random, in the ranges that stand above."""
    random = np.random.default_rng(SEED)
    ranges = ((0.1, 0.5), (-0.7, 0.7), (-1.0, 1.0), (0.1, 0.3), (-0.2, 0.2))
    width, slope, octaves, lobe, off = (random.uniform(*ends, count) for ends in ranges)
    return Layout(width, slope, 2.0**octaves, lobe, off)


def line(closeness, width, slope, x, w):
    """A line of light of fixed size in slope; its distance is 1 / closeness."""
    return jnp.exp(-0.5 * ((jnp.tan(w) - x * closeness - slope) / width) ** 2)


SKY = Function(lambda x, w: 1.0 + 0.05 * jnp.sin(w) + 0.0 * x)


def closeness(where: str, o: Layout) -> np.ndarray:
    """One over the light's distance [1/m]."""
    distances = {"near": 0.5 * o.radius, "middle": MIDDLE, "far": FAR}
    return np.broadcast_to(1.0 / distances.get(where, np.inf), o.radius.shape)


def turning(surface: str, o: Layout) -> tuple[np.ndarray, np.ndarray]:
    """Curvature of the ground, and the height of the waves in its normal: up to 20 rad/m."""
    waves = 20.0 / (2.0 * np.pi * WAVES) * (surface == "bumps")
    return -(surface != "flat") / o.radius, np.broadcast_to(waves, o.radius.shape)


# name: (where the light is, normal, lobe, the paper's entries)
ROWS = {
    "Distant light": (("environment",), "hill", "glossy", {"SV": "0", "B_x": "CDV"}),
    "Overcast sky": (("sky",), "hill", "glossy",
                     {"SV": "0", "DV": "low", "CDV": "low", "B_x": "low"}),
    "Near light": (("near",), "hill", "glossy", {"SV": "high", "B_x": "SV+CDV"}),
    "Bump map": (("near", "far"), "bumps", "glossy", {"CV": "high", "CDV": "high", "B_x": "CDV"}),
    "Flat surface": (("near", "far"), "flat", "glossy", {"CV": "0", "CDV": "0", "B_x": "SV"}),
    "Flat + envmap": (("environment",), "flat", "glossy",
                      {"SV": "0", "CV": "0", "CDV": "0", "B_x": "0"}),
    "Lambertian": (("near", "far"), "hill", "Lambert",
                   {"DV": "low", "CDV": "low", "B_x": "SV+CDV"}),
    "Mirror": (("near", "far"), "hill", "mirror", {"DV": "high", "B_x": "CDV"}),
}  # fmt: skip
# Why an entry does not hold, and where.
REASONS = {
    ("Lambertian", "B_x"): "Lambert's lobe turns with the normal once, so its curvature term is "
    "n_x L_theta (*) rho; the printed 2 n_x holds for lobes about the mirror direction. It fails "
    "on every curved Lambertian surface, most where CDV is all there is.",
    ("Mirror", "B_x"): "A sharper lobe raises SV as much as CDV, so that their ratio is that of "
    "any lobe: near the light SV stays. It holds under far light.",
    ("Mirror", "DV"): "A sharper lobe passes detail that a broader one blurs, and light that is as "
    "wide as the broader lobe has none: DV is then the same. It holds for light much narrower than "
    "the lobe that it is compared with.",
    ("Near light", "SV"): "SV goes as 1/d: what is near by the paper's criterion, 1/d = 2 n_x, is "
    "less than three times as near as 2 m where the hill is wide.",
    ("Lambertian", "DV"): "Light that is as wide as Lambert's lobe is not blurred much by it.",
    ("Lambertian", "CDV"): "Light that is as wide as Lambert's lobe is not blurred much by it.",
}


@eqx.filter_jit
def columns(sky: bool, lobe, near, curvature, waves, o: Layout, x) -> tuple[jax.Array, ...]:
    """The five columns at every x, with the paper's CV, 2 n_x whatever the lobe; and the value."""

    def one(near, curvature, waves, o: Layout):
        normal = Affine(jnp.stack([curvature, jnp.zeros_like(curvature)]), 0.0) + wave(WAVES, waves)
        light = Function(jax.tree_util.Partial(line, near, o.width, o.slope))
        material = lambert() if lobe == "Lambert" else glossy(o.lobe)
        B = Surface(normal, (material,)).reflect(SKY if sky else light, nodes=NODES)
        view = o.off - jnp.arctan(o.slope)
        (terms,) = B.terms(x, view)
        n_x = jax.vmap(lambda a: B.surface.normal_at(a).x)(x)
        jets = B.jets(x, view)
        CV = 2.0 * n_x
        return terms.SV, terms.DV, CV, CV * terms.DV, jets.gradient[:, 0], jets.value

    return jax.vmap(one)(near, curvature, waves, o)


Columns = dict[str, np.ndarray]


def measure(where: str, surface: str, lobe: str, o: Layout, x) -> Columns:
    """The columns along the patch, a row for each lay-out."""
    sharp = o._replace(lobe=np.full_like(o.lobe, 0.02)) if lobe == "mirror" else o
    kind = "Lambert" if lobe == "Lambert" else "glossy"  # one program for all that are glossy
    leaves = jax.tree.map(jnp.asarray, (closeness(where, o), *turning(surface, o), sharp))
    found = columns(where == "sky", kind, *leaves, jnp.asarray(x))
    return {k: np.asarray(v) for k, v in zip((*TERMS, "value"), found, strict=True)}


def rms(a: np.ndarray) -> np.ndarray:
    """Over the patch, of each lay-out."""
    return np.sqrt(np.mean(a**2, -1))


def draw(quick: bool) -> Drawing:
    count, many = (17, 8) if quick else (65, 256)
    x, o = np.linspace(-HALF, HALF, count), layouts(many)
    normal = measure("middle", "hill", "glossy", o, x)
    base = {k: rms(normal[k]) for k in TERMS}
    results: dict[str, tuple[Columns, dict[str, Statement]]] = {}
    zeros = []
    for name, (places, surface, lobe, entries) in ROWS.items():
        for where in places:
            row = f"{name}, {where}" if len(places) > 1 else name
            found = measure(where, surface, lobe, o, x)
            told = {
                k: _entry(row, k, e, found, base, f"{many} lay-outs") for k, e in entries.items()
            }
            zeros += [np.max(rms(found[k])) for k, e in entries.items() if e == "0"]
            results[row] = found, told
    claims = [
        Statement("Every 0 of the table: the largest of them, root mean square", "0", max(zeros),
                  at_most(ZERO, "rounding"), SOURCE, "", scanned=f"{many} lay-outs"),
        *(s for _, told in results.values() for k, s in told.items() if s.paper != "0"),
        *_texture(o, x, f"{many} lay-outs"),
    ]  # fmt: skip
    arrays = {f"{row}: {k}": v for row, (found, _) in results.items() for k, v in found.items()}
    arrays |= {"rows": np.array(list(results)), "columns": np.array(TERMS), **o._asdict()}
    size = f"{count} rays, {NODES} nodes, {many} lay-outs"
    return Drawing(_picture(results, base), arrays, claims, size=size, seed=SEED)


def _entry(row: str, k: str, entry: str, found, base, scanned: str) -> Statement:
    """One entry of the paper's table, over the lay-outs."""
    size, reason = rms(found[k]), REASONS.get((row.split(",")[0], k), "")
    unit = UNITS[TERMS.index(k)]
    if entry == "0":
        got, rule = Spread(float(np.max(size)), 0.0), at_most(ZERO, "rounding")
    elif entry in ("low", "high"):
        got, unit = geometric(size / base[k]), "of normal"
        rule = (
            at_most(LOW, "'low': below a fifth of normal") if entry == "low"
            else at_least(HIGH, "'high': above three times normal")
        )  # fmt: skip
    else:
        total = sum(found[part] for part in entry.split("+"))
        got, unit = spread(rms(found[k] - total) / size), "left over"
        rule = at_most(LEFT, "a tenth of the derivative is left over")
    words = f"{row}: {k} is {entry}"
    return Statement(words, entry, got.mean, rule, SOURCE, unit, got.error, scanned, reason)


def _texture(o: Layout, x, scanned: str) -> list[Statement | Measurement]:
    """R07 (20): of an albedo's waves on a Lambertian hill."""
    found = measure("middle", "hill", "Lambert", o, x)
    random = np.random.default_rng([SEED, 1])
    many = len(o.width)
    w = 2.0 * np.pi * 2.0 * 10.0 ** random.uniform(0.0, 1.0, many)[:, None]
    angle = w * x + random.uniform(0.0, 2.0 * np.pi, many)[:, None]
    masks = rms(found["value"] * 0.5 * w * np.cos(angle))
    ratio = masks / rms(found["B_x"] * (1.0 + 0.5 * np.sin(angle)))
    share, mean = spread(ratio > HIGH), geometric(ratio)
    return [
        Statement("High-frequency texture often masks slow shading variations: share of lay-outs "
                  "in which E rho_x is above three times E_x rho", "often", share.mean,
                  at_least(0.5, "'often': more than half"), "R07 §4.3", "", share.error, scanned),
        Measurement("Size of E rho_x over that of E_x rho", mean.mean, "times", mean.error,
                    "R07 (20)"),
    ]  # fmt: skip


def _picture(results, base) -> Figure:
    """One table, a row for each of the paper's; means over the lay-outs."""
    cells, verdicts = [], []
    for found, told in results.values():
        cells.append([_cell(k, told.get(k), found) for k in TERMS])
        verdicts.append([_tint(told.get(k)) for k in TERMS])
    figure, axes = plotting.panels(1, 1, 11.0, 8.0)
    heads = [
        f"{k} ({u})\nnormal: {geometric(base[k]).mean:.2f}"
        for k, u in zip(TERMS, UNITS, strict=True)
    ]
    title = "R07 Fig. 4 over lay-outs: the paper's entry, and what was measured"
    plotting.draw_table(axes[0, 0], heads, list(results), cells, verdicts, title=title)
    return figure


def _tint(told: Statement | None) -> str:
    """Whether an entry holds."""
    return "" if told is None else "unequal" if told.verdict == REFUTED else "equal"


def _cell(k: str, told: Statement | None, found) -> str:
    if told is None:
        return f"{float(np.mean(rms(found[k]))):.2g}"
    error = f" ± {told.error:.1g}" if told.error else ""
    return f"paper: {told.paper}\n{told.measured:.2g}{error} {told.unit}\n{told.verdict}"
