"""J12 §8 and §9: radii beside the largest disc, ellipse and set of equal true error, by search.

Two fields that are known exactly (`j12.shared.shadows`): a wide lamp alone, and with a plate before
it. From places all over the floor the search finds the largest disc (and ellipse, and connected set
of any shape) over which the linear expansion's error, J12 (67), is 1e-4 W; the fields are splines
of exact values. A radius that knows what it should is the disc's; its spread over places is what a
single factor, the threshold, cannot mend. So the spread tells metrics apart, and the median says
whether the tolerance means what it says (split spheres and the geometric bound have none).

`guarded` integrates the modulus of the Hessian's and of the third derivatives' terms together,
which keeps records at inflections from reaching too far. Hessian, third derivatives and what is
made of them are exact here; those of rays (radiometric, geometric, occlusion-aware) are gathered.

What betters J12's bound is the mean of |x^T H x| around the circle in the place of the largest
eigenvalue: its radii are the largest discs' within some per cent, in the penumbra too. What is left
there are the lines across which the Hessian jumps. Ellipses reach 2 to 9 % farther in area, sets of
any shape half as much again, which nobody could store.
"""

from __future__ import annotations

import functools
from collections.abc import Callable

import jax.numpy as jnp
import numpy as np
from scipy import interpolate, optimize

from figures.j12.shared.shadows import MORE, PLATES, Jet, exact_jet, exact_values, lit
from figures.spread import Spread, geometric
from figures.style import Drawing
from figures.verdicts import Measurement, Statement, at_least, at_most
from firstorder import plotting
from firstorder.caching import (
    derivative_norm,
    largest_set,
    radius_for,
    semi_axes,
)
from firstorder.caching.candidate_tables import gather_directions, tabulate_candidates
from firstorder.caching.occlusion import occlusion_table
from firstorder.plotting.style import COLOURS

FIELDS = {"lamp": "lamp alone", "plate": "lamp and plate"}
TOLERANCE = 1e-4
MOST = 0.4  # larger discs are not looked for [m]
SPLIT = ("minimum", "harmonic")
HESSIANS = ("radiometric", "geometric", "occlusion-aware")
SCALED = (*SPLIT, "geometric")
DRAWN = 7  # every so manieth disc


def draw(quick: bool) -> Drawing:
    side, nodes = (3, 41) if quick else (20, 201)
    figure, axes = plotting.panels(2, 3, 2.6, 2.4, width_ratios=[1, 1, 1.2])
    claims, arrays = [], {}
    x = _places(side)
    for row, (name, words) in enumerate(FIELDS.items()):
        jet = exact_jet(name, x)
        E = _field(name, nodes)
        own = {k: _searched(E, x, jet, order=k) for k in (1, 2)}
        wide, free = _ellipses(E, x, jet, own[1]), _sets(E, x, jet)
        radii = _radii(name, x, jet, own[1], quick)
        over = {m: np.minimum(R, MOST) / own[1] for m, R in radii.items()}
        third = np.asarray(derivative_norm(jnp.asarray(jet.third), 3, "mean"))
        second = np.asarray(radius_for(third, TOLERANCE, order=2, dims=2))
        over["third order"] = np.minimum(second, MOST) / own[2]
        _draw_field(axes[row, 0], E, x, own[1], words)
        _draw_radii(axes[row, 1], radii, own[1])
        _draw_ratios(axes[row, 2], over)
        found = {"disc": own[1], "disc_2": own[2], "ellipse": wide, "set": free}
        arrays |= {f"{name}_{k.replace(' ', '_')}": v for k, v in (found | over).items()}
        claims += _claims(words, over, own, wide, free)
        if name == "lamp":
            claims.append(_betters(words, _better(over), "places all over the floor"))
    plates = tuple(PLATES | MORE)[: 2 if quick else None]
    gains = geometric([_gain(name, x, nodes, quick) for name in plates])
    scanned = f"{len(plates)} plates, places all over the floor"
    claims.append(_betters("lamp and a plate, geometric mean", gains, scanned))
    size = f"{side}^2 places, {nodes}^2 exact values, {len(plates)} plates"
    return Drawing(figure, arrays, claims, size=size, seed=12)


def _places(side: int) -> np.ndarray:
    """One place in each of equal cells of the floor."""
    cell = np.stack(np.meshgrid(np.arange(side), np.arange(side)), -1).reshape(-1, 2)
    return (cell + np.random.default_rng(12).random(cell.shape)) / side


Field = Callable[[np.ndarray], np.ndarray]


@functools.cache
def _field(name: str, nodes: int) -> Field:
    """The irradiance as a cubic spline of exact values, also beside the floor."""
    s = np.linspace(-MOST, 1.0 + MOST, nodes)
    x = np.stack(np.meshgrid(s, s, indexing="ij"), -1)
    spline = interpolate.RectBivariateSpline(s, s, exact_values(name, x))
    return lambda p: spline.ev(p[..., 0], p[..., 1])


# --- search --------------------------------------------------------------------------------------

RINGS, AROUND = 60, 36


def _ring(stretch: float = 0.0, angle: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Steps on rings of an ellipse of that log ratio of axes and angle, and their radii."""
    r = MOST * (np.arange(RINGS) + 0.5) / RINGS
    phi = 2.0 * np.pi * (np.arange(AROUND) + 0.5) / AROUND
    u, v = np.exp(0.5 * stretch) * np.cos(phi), np.exp(-0.5 * stretch) * np.sin(phi)
    c, s = np.cos(angle), np.sin(angle)
    return r[:, None, None] * np.stack([c * u - s * v, s * u + c * v], -1), r


def _size(miss: np.ndarray, r: np.ndarray) -> float:
    """The radius at which the integrated modulus of the miss, given on rings, is the tolerance."""
    step = r[1] - r[0]
    total = np.cumsum(np.mean(np.abs(miss), axis=1) * 2.0 * np.pi * r * step)
    grown = np.concatenate([[0.0], total])
    at = np.concatenate([[0.0], r + 0.5 * step])
    # The integral goes as R^4 and more: its root is nearly straight in R.
    return float(np.interp(TOLERANCE**0.25, grown**0.25, at))


def _taylor(jet: Jet, k: int, dx: np.ndarray, order: int) -> np.ndarray:
    value = jet.E[k] + dx @ jet.gradient[k]
    if order == 2:
        value = value + 0.5 * np.einsum("...i,ij,...j", dx, jet.hessian[k], dx)
    return value


def _searched(E: Field, x: np.ndarray, jet: Jet, order: int) -> np.ndarray:
    """Radius of the largest disc at each place."""
    dx, r = _ring()
    return np.array([_size(E(p + dx) - _taylor(jet, k, dx, order), r) for k, p in enumerate(x)])


def _ellipses(E: Field, x: np.ndarray, jet: Jet, disc: np.ndarray) -> np.ndarray:
    """Geometric mean of the axes of the largest ellipse, of a ratio of at most 4."""
    found = []
    for k, p in enumerate(x):

        def lost(given, k=k, p=p):
            dx, r = _ring(float(np.clip(given[0], -np.log(4.0), np.log(4.0))), given[1])
            return -_size(E(p + dx) - _taylor(jet, k, dx, 1), r)

        starts = ([0.7, 0.0], [0.7, 0.8], [0.7, -0.8], [0.7, 1.6])
        best = min(starts, key=lost)
        found.append(
            -optimize.minimize(lost, best, method="Nelder-Mead", options={"maxfev": 40}).fun
        )
    return np.maximum(found, disc)


def _sets(E: Field, x: np.ndarray, jet: Jet, cells: int = 81) -> np.ndarray:
    """Radius of a disc as large as the largest connected set of any shape."""
    s = MOST * (2.0 * (np.arange(cells) + 0.5) / cells - 1.0)
    dx = np.stack(np.meshgrid(s, s), -1)
    area = [
        largest_set(
            E(p + dx) - _taylor(jet, k, dx, 1),
            (s[1] - s[0]) ** 2,
            TOLERANCE,
            near=(cells // 2, cells // 2),
        )[1]
        for k, p in enumerate(x)
    ]
    return np.sqrt(np.array(area) / np.pi)


# --- radii ---------------------------------------------------------------------------------------


def _radii(
    name: str, x: np.ndarray, jet: Jet, own: np.ndarray, quick: bool
) -> dict[str, np.ndarray]:
    """What each metric gives for the tolerance; those in `SCALED` with the median of `own`."""
    maps = lit(name)
    (floor,) = maps.scene.named("floor")
    table = tabulate_candidates(
        maps, x, gather_directions(*((16, 48) if quick else (60, 180))), floor
    )
    aware = occlusion_table(maps, x, floor, rays=256 if quick else 1024)

    def disc(H, kind="largest"):
        return np.asarray(radius_for(derivative_norm(jnp.asarray(H), 2, kind), TOLERANCE, dims=2))

    axes, _ = semi_axes(jnp.asarray(jet.hessian), TOLERANCE, most=4.0)
    radii = {
        "minimum": table.minimum,
        "harmonic": table.harmonic,
        "radiometric": disc(table.hessian),
        "geometric": disc(table.geometric),
        "occlusion-aware": disc(aware.hessian),
        "aware, mean": disc(aware.hessian, "mean"),
        "exact": disc(jet.hessian),
        "exact, mean": disc(jet.hessian, "mean"),
        "ellipse": np.sqrt(np.prod(np.asarray(axes), axis=1)),
        "guarded": _guarded(jet),
    }
    # Before anything cuts them: lengths of rays are no radii yet.
    return radii | {m: radii[m] / np.median(radii[m] / own) for m in SCALED}


def _gain(name: str, x: np.ndarray, nodes: int, quick: bool) -> float:
    """Spread of the better split sphere over that of the best gathered Hessian, on one floor."""
    jet = exact_jet(name, x)
    own = _searched(_field(name, nodes), x, jet, order=1)
    radii = _radii(name, x, jet, own, quick)
    return _better({m: np.minimum(R, MOST) / own for m, R in radii.items()}).mean


def _guarded(jet: Jet) -> np.ndarray:
    """Radii of the error that Hessian and third derivatives expect together."""
    dx, r = _ring()
    second = 0.5 * np.einsum("kai,mij,kaj->mka", dx, jet.hessian, dx)
    third = np.einsum("kai,kaj,kal,mijl->mka", dx, dx, dx, jet.third, optimize=True) / 6.0
    return np.array([_size(a + b, r) for a, b in zip(second, third, strict=True)])


# --- what is shown -------------------------------------------------------------------------------


def _spread(ratios: np.ndarray) -> float:
    """The ninetieth percentile over the tenth."""
    low, high = np.percentile(ratios, [10, 90])
    return float(high / low)


def _draw_field(ax, E: Field, x, R, words: str) -> None:
    s = (np.arange(96) + 0.5) / 96
    ax.imshow(E(np.stack(np.meshgrid(s, s), -1)), cmap="magma", extent=(0, 1, 0, 1), vmin=0.0)
    around = np.linspace(0.0, 2.0 * np.pi, 60)
    for p, radius in zip(x[::DRAWN], R[::DRAWN], strict=True):
        ax.plot(p[0] + radius * np.cos(around), p[1] + radius * np.sin(around), "-w", linewidth=0.5)
    ax.set(xticks=[], yticks=[], xlim=(0, 1), ylim=(0, 1))
    ax.set_title(f"{words}: largest discs", fontsize=8)


def _draw_radii(ax, radii, own) -> None:
    for k, method in enumerate(("radiometric", "occlusion-aware", "exact")):
        ax.plot(
            own, np.minimum(radii[method], MOST), ".", markersize=2, color=COLOURS[k], label=method
        )
    ax.plot([0.0, 0.2], [0.0, 0.2], "-", color="0.6", linewidth=0.8)
    ax.set(xlim=(0.0, 0.2), ylim=(0.0, 0.2), xlabel="radius by search (m)", ylabel="radius (m)")
    ax.legend(fontsize=6)


def _draw_ratios(ax, over) -> None:
    names = list(over)
    for y, name in enumerate(names):
        low, middle, high = np.percentile(over[name], [10, 50, 90])
        ax.plot([low, high], [y, y], "-", color="0.45", linewidth=1.2)
        ax.plot([middle], [y], "o", color=COLOURS[1], markersize=3.5)
    ax.axvline(1.0, color="0.7", linewidth=0.8)
    ax.set(yticks=range(len(names)), xlabel="radius over search's")
    ax.set_yticklabels(names, fontsize=6.5)
    ax.invert_yaxis()
    ax.yaxis.tick_right()


def _error(number: Callable[..., float], *ratios: np.ndarray) -> float:
    """Standard error of a number of the places, by drawing them again."""
    rng, count = np.random.default_rng(12), len(ratios[0])
    again = [rng.integers(0, count, count) for _ in range(200)]
    return float(np.std([number(*(r[rows] for r in ratios)) for rows in again]))


def _claims(words: str, over, own, wide, free) -> list:
    claims: list = []
    for m in ("radiometric", "occlusion-aware", "exact"):
        middle = float(np.median(over[m]))
        claims.append(
            Statement(
                "The largest eigenvalue bounds the error conservatively: radius over that of the "
                f"largest disc of equal true error, median, {m} Hessian, {words}",
                "conservative",
                middle,
                at_most(1.0, "'conservatively bound': no larger than the disc"),
                "J12 §8.2, (69)",
                error=_error(lambda r: float(np.median(r)), over[m]),
                scanned="places all over the floor",
                reason=UNBOUNDED,
            )
        )
    spreads = ("minimum", "harmonic", "radiometric", "geometric", "occlusion-aware")
    for m in (*spreads, "exact", "exact, mean", "guarded", "third order"):
        claims.append(
            Measurement(
                f"90th over 10th percentile of radius over that of the largest disc, {m}; {words}",
                _spread(over[m]),
                error=_error(_spread, over[m]),
            )
        )
    for m, name in (("exact, mean", "exact, mean around"), ("third order", "third order")):
        claims.append(
            Measurement(
                f"Median of radius over that of the largest disc, {name}; {words}",
                float(np.median(over[m])),
                error=_error(lambda r: float(np.median(r)), over[m]),
            )
        )
    aware = over["occlusion-aware"], over["aware, mean"]
    claims.append(
        Measurement(
            "Spread of the occlusion-aware Hessian's radii about the largest discs' by the largest "
            f"eigenvalue over that by the mean of |x H x| around, {words}",
            _ratio(*aware),
            error=_error(_ratio, *aware),
        )
    )
    for radius, name in ((wide, "ellipse"), (free, "connected set")):
        area = (radius / own[1]) ** 2
        claims.append(
            Measurement(
                f"Area of the largest {name} over that of the largest disc, median, {words}",
                float(np.median(area)),
                error=_error(lambda r: float(np.median(r)), area),
            )
        )
    return claims


UNBOUNDED = (
    "The Hessian by surface area leaves out what the edge of the shadow adds, so that radii in the "
    "penumbra are too large; the bound itself is met by the exact Hessian."
)


def _ratio(one: np.ndarray, other: np.ndarray) -> float:
    return _spread(one) / _spread(other)


def _better(over: dict[str, np.ndarray]) -> Spread:
    """The least spread of split spheres over the least of gathered Hessians, on one floor."""
    one, other = (min(among, key=lambda m: _spread(over[m])) for among in (SPLIT, HESSIANS))
    pair = over[one], over[other]
    return Spread(_ratio(*pair), _error(_ratio, *pair))


def _betters(words: str, gain: Spread, scanned: str) -> Statement:
    """That the best gathered Hessian's radii follow the largest discs better than split spheres."""
    return Statement(
        "A principled estimate of the error betters split spheres: spread of radii over the "
        "largest discs' (90th over 10th percentile), the better split sphere's over that of the "
        f"best gathered Hessian, {words}",
        "superior",
        gain.mean,
        at_least(1.0, "'better': the smaller spread"),
        "J12 §8.2",
        error=gain.error,
        scanned=scanned,
        reason="At places in the penumbra the Hessian by surface area misses most of the second "
        "derivative, and radii are of any size; alone the lamp has no penumbra.",
    )
