"""D05 Fig. 17: an image of 20,000 shaded pixels, evenly spread or where bandwidth says.

Scene, criteria and samples are those of Fig. 16. All errors are against the image of which every
pixel is shaded; "on screen" means clipped at the 99 % quantile of radiance, gamma 2.2, and so is
SSIM. The pictures have four visibility samples a pixel, as the paper's: depth and normals of each
guide the filter, and 2 x 2 values are averaged; their truth shades all four where their labels
differ. Elsewhere one sample a pixel is reconstructed.

A shaded pixel keeps its value. So every error falls to nothing when all are shaded; a filter that
blurs its samples too would keep what it blurs.

Cost. Primary rays (4 a pixel) and the filter serve both ways. Only the adaptive way needs 100 rays
at 20,000 points to find blockers, 26 % of the 384 rays a shaded pixel takes here. Equal rays: the
uniform image gets as many samples more as these rays would shade. Equal time: as many as processor
time of blockers, their filter and differences would shade, measured in this run. The paper counts
neither, and gives no numbers: "better captures the sharp detail in the shiny dinosaur's head and
feet" is judged there.

What loses, at full size. At equal time the uniform image has twice the samples; the adaptive one
still has the lower errors, but by the paper's filter not the higher SSIM, which looks at the floor
too, where few samples are left. Half of that time goes to the blockers' rays (each costs more than
one that shades, as it needs a distance), half to the filter that spreads what they find. Blockers
matter on screen; without them the criterion costs a twentieth, and radiance alone gains as much.
The filter loses most: over a triangulation that does not cross labels uniform images err a sixth
less and adaptive ones a third less, and there the adaptive image wins by all measures at equal time
too. The filter blurs what is curved or slanted, where its normals admit little. It also fails
where it looks at the nearest samples alone: beside a densely sampled shape they all lie on the
shape (`methods.bilateral` looks farther; errors on screen were 2 to 3 times larger before).
Nyquist's rate, the square of the bandwidth, is the worst density: it spends what it has on slants.
"""

from __future__ import annotations

import numpy as np

from figures import _d05_creatures as creatures
from figures import _d05_sampling as shared
from figures._r07_table import show
from figures.style import Claim, Drawing
from firstorder import plotting
from firstorder.methods.bilateral import widths

WAYS = ("bilateral", "delaunay")
STEPS = (0.125, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0)  # times the paper's samples
POWERS = {"1": 1.0, "4/3": 4.0 / 3.0, "2": 2.0}
CROPS = {"head": (0.40, 0.54, 0.56, 0.79), "feet": (0.22, 0.17, 0.47, 0.43)}
NAMES = {"even": "uniform", **shared.WORDS}


class Run:
    """The scene with its truth, and images made of few samples."""

    def __init__(self, quick: bool):
        self.world, self.count = creatures.world(quick), shared.budget(quick)
        self.view = creatures.view(self.world)
        self.truth = creatures.reference(self.world).sum(-1)
        self.white = float(np.quantile(self.truth, 0.99))
        self.found = shared.criteria(self.world, self.view, self.count)
        even = np.ones(self.truth.shape)
        self.density = {"even": even}
        self.density |= {k: shared.spread(B) for k, B in self.found.maps.items()}

    def errors(self, density, count: int, way: str = "bilateral"):
        """RMSE, RMSE on screen and SSIM of an image of that many samples."""
        made = shared.image(self.view, self.truth, density, count, way)[1]
        return shared.errors(made, self.truth, self.white)

    def shading(self) -> float:
        """Processor time of a shaded pixel [s]."""
        rows = np.random.default_rng(1).permutation(self.truth.size)[:1024]
        at = creatures.some(self.view.at, rows)
        index = self.view.shows.ravel()[rows]
        creatures.shade(self.world, at, index)
        return shared.timed(lambda: creatures.shade(self.world, at, index))[0] / len(rows)


def draw(quick: bool) -> Drawing:
    run = Run(quick)
    N = run.count
    table = {(k, w): run.errors(d, N, w) for k, d in run.density.items() for w in WAYS}
    cost = _costs(run)
    even = run.density["even"]
    equal = {(k, w): run.errors(even, n, w) for k, n in cost.items() for w in WAYS}
    powers = {
        (k, p): run.errors(shared.spread(run.found.maps[k], power), N)
        for k in ("plain", "light")
        for p, power in POWERS.items()
    }
    white_noise = _without_blue(run)
    budgets = np.array([int(N * s) for s in STEPS[:: 3 if quick else 1]] + [run.truth.size])
    curves = {
        (k, w): np.array([run.errors(run.density[k], n, w)[0] for n in budgets])
        for k in ("even", "plain", "light")
        for w in WAYS
    }
    true, images = _finely(run)

    figure, axes = plotting.panels(3, 3, 4.4, 2.75)
    _pictures(run, axes, true, images)
    _curves(axes[2, 2], budgets, curves)
    _error(axes[2, 0], images["even"] - true, "g) error, uniform")
    _error(axes[2, 1], images["plain"] - true, "h) error, adaptive")
    claims = [
        *_equal_samples(table),
        *_with_four(run, true, images),
        *_equal_cost(table, equal, cost, N),
        *_parts(table, powers, white_noise),
        *_falling(curves),
    ]
    columns = {f"{NAMES[k]}, {w}": v for (k, w), v in curves.items()}
    arrays = {"truth": true, **{f"image {k}": v for k, v in images.items()}}
    size = f"{run.world.columns} x {run.world.rows} pixels, {N} samples"
    return Drawing(figure, arrays, claims, {"rmse": {"samples": budgets, **columns}}, size, 0)


def _costs(run: Run) -> dict[str, int]:
    """Samples of a uniform image that costs what the paper's adaptive one does."""
    took, N = run.found.seconds, run.count
    each, blockers = run.shading(), took["plain"] + took["plain filter"]
    return {
        "rays": int(N * (1.0 + shared.RAYS / creatures.PER_SAMPLE)),
        "time": int(N + (blockers + took["differences"]) / each),
        "mirror": int(N + took["differences"] / each),
    }


def _without_blue(run: Run) -> tuple[float, float, float]:
    """Errors of samples placed at the paper's density, but independently."""
    density = run.density["plain"]
    rng = np.random.default_rng(2)
    key = rng.exponential(size=density.shape) / density  # the smallest: drawn without replacement
    at = np.argwhere(key <= np.partition(key.ravel(), run.count - 1)[run.count - 1])
    width = widths(density, len(at))
    made = shared.filtered(run.view, at, run.truth[tuple(at.T)], width)
    return shared.errors(made, run.truth, run.white)


def _finely(run: Run):
    """The truth and the images with four visibility samples a pixel."""
    world = run.world._replace(columns=2 * run.world.columns, rows=2 * run.world.rows)
    fine = creatures.view(world)
    w, h = run.truth.shape
    four = fine.label.reshape(w, 2, h, 2).transpose(0, 2, 1, 3).reshape(w, h, 4)
    edge = np.any(four != run.view.label[..., None], -1)
    rows = np.flatnonzero(np.repeat(np.repeat(edge, 2, 0), 2, 1))
    value = np.repeat(np.repeat(run.truth, 2, 0), 2, 1)
    shown = fine.shows.ravel()[rows]
    value.flat[rows] = creatures.shade(world, creatures.some(fine.at, rows), shown).sum(-1)
    images = {}
    for name in ("even", "plain"):
        at = shared.chosen(run.density[name], run.count)
        width = widths(run.density[name], len(at))
        images[name] = shared.finely(run.view, fine, at, run.truth[tuple(at.T)], width)
    return shared.averaged(value), images


# --- pictures ------------------------------------------------------------------------------------


def _pictures(run: Run, axes, true, images) -> None:
    looks = {"reference": true, "uniform": images["even"], "adaptive": images["plain"]}
    for k, (name, values) in enumerate(looks.items()):
        screen = shared.shown(values, run.white)
        options = dict(cmap="gray", vmin=0.0, vmax=1.0)
        show(axes[0, k], screen, f"{'abc'[k]}) {name}", **options)
        show(axes[1, k], screen[_crop(screen, "head")], f"{'def'[k]}) {name}, the head", **options)


def _crop(values, name: str):
    w, h = values.shape
    left, low, right, high = CROPS[name]
    return slice(int(left * w), int(right * w)), slice(int(low * h), int(high * h))


def _error(ax, miss, title: str) -> None:
    show(ax, abs(miss), f"{title} (white: 0.1 W/(m$^2$ sr))", cmap="gray", vmin=0.0, vmax=0.1)


def _curves(ax, budgets, curves) -> None:
    for (name, way), rmse in curves.items():
        k = ("even", "plain", "light").index(name)
        style = "o-" if way == "bilateral" else "^--"
        label = f"{NAMES[name]}, {'filter' if way == 'bilateral' else 'triangles'}"
        ax.loglog(budgets[:-1], rmse[:-1], style, color=plotting.COLOURS[k], markersize=3,
                  linewidth=1.0, label=label)  # fmt: skip
    ax.set(title="i) error by budget; 0 when all are shaded", xlabel="samples",
           ylabel="RMSE (W/(m$^2$ sr))")  # fmt: skip
    ax.legend(fontsize=5.5)


# --- claims --------------------------------------------------------------------------------------


def _triple(e) -> str:
    return f"{e[0]:.4f}, {e[1]:.4f}, {e[2]:.4f}"


def _better(e, other) -> bool:
    """In all three measures."""
    return e[0] < other[0] and e[1] < other[1] and e[2] > other[2]


def _equal_samples(table) -> list[Claim]:
    even = table["even", "bilateral"]
    about = "RMSE (W/(m^2 sr)), RMSE on screen, SSIM at 20,000 samples"
    claims = [Claim(f"{about}: uniform", None, _triple(even))]
    for name, words in shared.WORDS.items():
        e = table[name, "bilateral"]
        paper = "better than uniform" if name == "plain" else None
        claims.append(Claim(f"{about}: {words}", paper, _triple(e), "", _better(e, even)))
    return claims


def _with_four(run: Run, true, images) -> list[Claim]:
    found = {k: shared.errors(v, true, run.white) for k, v in images.items()}
    claims = [
        Claim("The same with four visibility samples a pixel: uniform, then with blockers",
              "better than uniform", f"{_triple(found['even'])}; {_triple(found['plain'])}", "",
              _better(found["plain"], found["even"]))
    ]  # fmt: skip
    screen = {k: shared.shown(v, run.white) for k, v in {"true": true, **images}.items()}
    for name in CROPS:
        crop = _crop(true, name)
        even, own = (
            float(np.sqrt(np.mean((screen[k] - screen["true"])[crop] ** 2)))
            for k in ("even", "plain")
        )
        words = f"Error on screen at the shiny creature's {name}, uniform over adaptive"
        paper = "sharp detail better captured"
        claims.append(Claim(words, paper, even / own, "times", even > own))
    return claims


def _equal_cost(table, equal, cost, N) -> list[Claim]:
    words = {
        "rays": ("plain", "equal rays, those to find blockers counted"),
        "time": ("plain", "equal processor time, all that a criterion costs counted"),
        "mirror": ("mirror", "equal processor time, criterion without blockers"),
    }
    claims = []
    for kind, (name, how) in words.items():
        claims.append(Claim(f"Uniform samples at {how}, over adaptive ones", None, cost[kind] / N,
                            "times"))  # fmt: skip
        for way, other in (("bilateral", ""), ("delaunay", ", both over triangulations")):
            e, even = table[name, way], equal[kind, way]
            text = f"Uniform image's RMSE, RMSE on screen, SSIM at {how}{other}"
            paper = "adaptive is better (at equal samples)" if name == "plain" else None
            claims.append(Claim(text, paper, _triple(even), "", _better(e, even)))
    return claims


def _parts(table, powers, white_noise) -> list[Claim]:
    """Criterion, placement and reconstruction, one changed at a time."""
    claims = []
    for name, words in NAMES.items():
        e, other = table[name, "delaunay"], table[name, "bilateral"]
        claims.append(Claim(f"Over a triangulation in place of the filter: {words}", None,
                            _triple(e), "", _better(e, other)))  # fmt: skip
    for (name, power), e in powers.items():
        holds = _better(e, table["even", "bilateral"])
        claims.append(Claim(f"Density as bandwidth to the power {power}, {NAMES[name]}", None,
                            _triple(e), "", holds))  # fmt: skip
    blue = table["plain", "bilateral"]
    claims.append(Claim("Independent samples in place of blue noise, with blockers", "blue noise",
                        _triple(white_noise), "", _better(blue, white_noise)))  # fmt: skip
    return claims


def _falling(curves) -> list[Claim]:
    falls = all(np.all(np.diff(rmse) < 0.0) for rmse in curves.values())
    least = max(float(rmse[-1]) for rmse in curves.values())
    return [
        Claim("Every error falls from each budget to the next, and is nothing when all are shaded",
              None, f"{'yes' if falls else 'no'}, {least:.1e}", "", falls and least == 0.0)
    ]  # fmt: skip
