"""R07 Fig. 4: which gradient term matters when, measured on one concrete scene per row.

The paper's table says "low" and "high" and leaves "normal" blank, without numbers. Chosen here: a
hill of radius 1 m, a Gaussian lobe of 0.15 rad, seen from 0.3 rad, and a line of light that shines
the same in all directions, 0.1 wide in slope (standard deviation) about slope 0.5, at 0.5 m (near)
or 50 m (distant). Each term is the root mean square over 0.8 m about the distant light's highlight.
"Normal" is that scene with the light at 2 m; *low* is below a fifth of it, *high* above three times
it, zero below 1e-12. `B_x = CDV` (or another sum) holds if what is left over is below a tenth. Each
row changes one thing: the light (none that varies in x; a sky `1 + sin(theta) / 20`), the curvature
(bumps of up to 20 per metre, or none), the lobe (0.02 rad for the mirror; Lambert's). CV and CDV
are the paper's, with 2 n_x for every lobe.

What does not hold. Lambert's lobe turns with the normal once, so the curvature term is
`n_x L_theta (*) rho`, and with the paper's 2 n_x the sum misses B_x. A sharper lobe raises SV as
much as CDV: a mirror near the light is not `B_x = CDV`. (And a mirror's DV is high only where the
light has detail that the other lobe blurs: under a light 0.35 wide it is about normal.)
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from figures.style import Claim, Drawing
from firstorder import plotting
from firstorder.fields import Affine, Constant, Field, Function
from firstorder.transport.lobes import Lobe, glossy, lambert
from firstorder.transport.shading import Surface
from firstorder.transport.texture import wave

VIEW, ENDS = 0.3, (-0.8, 0.0)
TERMS = ("SV", "DV", "CV", "CDV", "B_x")
UNITS = ("1/m", "1/rad", "rad/m", "1/m", "1/m")


def line(d: float) -> Field:
    """A line of light at height d, of fixed size in slope; d = inf is an environment."""
    return Function(lambda x, w: jnp.exp(-0.5 * ((jnp.tan(w) - x / d - 0.5) / 0.1) ** 2))


SKY = Function(lambda x, w: 1.0 + 0.05 * jnp.sin(w) + 0.0 * x)
HILL, FLAT = Affine([-1.0, 0.0], 0.0), Constant(0.0)
BUMPS = HILL + wave(8.0, 20.0 / (2.0 * np.pi * 8.0))
NEAR, MIDDLE, FAR, NOWHERE = line(0.5), line(2.0), line(50.0), line(np.inf)
GLOSSY, MIRROR = glossy(0.15), glossy(0.02)

# name: (lights, normal, lobe, the paper's entries)
ROWS: dict[str, tuple[dict[str, Field], Field, Lobe, dict[str, str]]] = {
    "Distant light": ({"distant": NOWHERE}, HILL, GLOSSY, {"SV": "0", "B_x": "CDV"}),
    "Overcast sky": (
        {"distant": SKY},
        HILL,
        GLOSSY,
        {"SV": "0", "DV": "low", "CDV": "low", "B_x": "low"},
    ),
    "Near light": ({"near": NEAR}, HILL, GLOSSY, {"SV": "high", "B_x": "SV+CDV"}),
    "Bump map": (
        {"near": NEAR, "distant": FAR},
        BUMPS,
        GLOSSY,
        {"CV": "high", "CDV": "high", "B_x": "CDV"},
    ),
    "Flat surface": (
        {"near": NEAR, "distant": FAR},
        FLAT,
        GLOSSY,
        {"CV": "0", "CDV": "0", "B_x": "SV"},
    ),
    "Flat + envmap": (
        {"distant": NOWHERE},
        FLAT,
        GLOSSY,
        {"SV": "0", "CV": "0", "CDV": "0", "B_x": "0"},
    ),
    "Lambertian": (
        {"near": NEAR, "distant": FAR},
        HILL,
        lambert(),
        {"DV": "low", "CDV": "low", "B_x": "SV+CDV"},
    ),
    "Mirror": ({"near": NEAR, "distant": FAR}, HILL, MIRROR, {"DV": "high", "B_x": "CDV"}),
}


def measure(light: Field, normal: Field, lobe: Lobe, count: int) -> dict[str, np.ndarray]:
    """The five columns along the surface, with the paper's CV: 2 n_x whatever the lobe."""
    x = jnp.linspace(*ENDS, count)
    B = Surface(normal, (lobe,)).reflect(light, nodes=160)

    @jax.jit
    def run(x):
        (terms,) = B.terms(x, VIEW)
        n_x = jax.vmap(lambda a: B.surface.normal_at(a).x)(x)
        return terms.SV, terms.DV, 2.0 * n_x, 2.0 * n_x * terms.DV, B.jets(x, VIEW).gradient[:, 0]

    return {k: np.asarray(v) for k, v in zip(TERMS, run(x), strict=True)}


def rms(a: np.ndarray) -> float:
    return float(np.sqrt(np.mean(a**2)))


def holds(entry: str, name: str, found: dict[str, np.ndarray], normal: dict[str, float]) -> bool:
    """Whether one entry of the paper's table is so."""
    size = rms(found[name])
    if entry == "0":
        return size < 1e-12
    if entry in ("low", "high"):
        return size < 0.2 * normal[name] if entry == "low" else size > 3.0 * normal[name]
    total = sum(found[part] for part in entry.split("+"))
    return rms(found[name] - total) < 0.1 * size


def draw(quick: bool) -> Drawing:
    count = 33 if quick else 257
    base = {k: rms(v) for k, v in measure(MIDDLE, HILL, GLOSSY, count).items()}
    names, cells, verdicts, claims, arrays, table = [], [], [], [], {}, []
    for name, (lights, normal, lobe, entries) in ROWS.items():
        for where, light in lights.items():
            found = measure(light, normal, lobe, count)
            good = {k: holds(e, k, found, base) for k, e in entries.items()}
            names.append(f"{name}, {where}" if len(lights) > 1 else name)
            cells.append([_words(found[k], entries.get(k), good.get(k)) for k in TERMS])
            cells[-1].append("yes" if all(good.values()) else "no")
            verdicts.append(
                [{None: "", True: "equal", False: "unequal"}[good.get(k)] for k in TERMS]
            )
            verdicts[-1].append("equal" if all(good.values()) else "unequal")
            table.append([rms(found[k]) for k in TERMS])
            arrays |= {f"{names[-1]}: {k}": v for k, v in found.items()}
            claims += [
                Claim(f"{names[-1]}: {k} is {entry}", entry, *_measured(k, entry, found, base), ok)
                for (k, entry), ok in zip(entries.items(), good.values(), strict=True)
            ]
    figure, axes = plotting.panels(1, 1, 11.0, 8.0)
    heads = [f"{k} ({u})\nnormal {base[k]:.2f}" for k, u in zip(TERMS, UNITS, strict=True)]
    plotting.table(
        axes[0, 0],
        [*heads, "all hold?"],
        names,
        cells,
        verdicts,
        title="R07 Fig. 4, measured: root mean square, and whether the paper's entry holds",
    )
    arrays |= {"table": np.array(table), "rows": np.array(names), "columns": np.array(TERMS)}
    return Drawing(figure, arrays, claims, size=f"{count} rays, 160 nodes")


def _measured(k: str, entry: str, found, base) -> tuple[float, str]:
    """What decides an entry, with its unit."""
    if entry == "0":
        return rms(found[k]), UNITS[TERMS.index(k)]
    if entry in ("low", "high"):
        return rms(found[k]) / base[k], "of normal"
    total = sum(found[part] for part in entry.split("+"))
    return rms(found[k] - total) / rms(found[k]), "left over"


def _words(values: np.ndarray, entry: str | None, ok: bool | None) -> str:
    size = rms(values)
    number = f"{size:.2f}" if size >= 0.005 else f"{size:.0e}" if size > 1e-12 else "0"
    return number if entry is None else f"{number}\npaper: {entry}, {'holds' if ok else 'does not'}"
