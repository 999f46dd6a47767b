"""Beside the peers: what `make compare` kept, in tables, with the reasons where we lose."""

from __future__ import annotations

import json
from typing import Any

from docs.generate import kept
from docs.generate import markdown as md

FOLDER = kept.FOLDER / "peers"
SHADOWS = ("ball", "overlapping", "box")
NEVER = "not reached"


def pages() -> dict[str, str]:
    """The page, of the results that are kept."""
    text = (FOLDER / "results.json").read_text(encoding="utf-8")
    return {"peers.md": page(json.loads(text))}


def page(results: dict[str, Any]) -> str:
    """All comparisons that were run."""
    words = (
        "The same scenes through Radiance, Mitsuba 3, NumPy, numba and this library, on one core, "
        "in turns, by processor time of all programs that were run, with the first call of "
        "everything (compilation) left out and told apart. `make compare` measures all again; what "
        "is not installed is left out in one sentence. Times are ratios: a machine that is busy "
        "spreads them by some ten per cent."
    )
    makers = {"gradients": _gradients, "floor_cache": _floor_cache, "one_bounce": _one_bounce,
              "flatland_hits": _flatland_hits}  # fmt: skip
    parts = [make(results[name]) for name, make in makers.items() if name in results]
    return md.page("Beside the peers", words, *parts)


def _closing(found: dict[str, Any]) -> str:
    """What it was made with, and who was left out."""
    versions = ", ".join(f"{p} {v}" for p, v in found["setting"]["versions"].items())
    s = found["setting"]
    words = f"Made with {versions}; Python {s['python']}, {s['processor']}, {s['cores']} core."
    size = " At quick size, which says only that it runs." if found["quick"] else ""
    return " ".join([words + size, *found["left out"]])


def _picture(words: str, name: str) -> str:
    return f"![{words}](../kept/peers/{name}.png)"


def digits(number: float | None) -> str:
    """A ratio or an error in two digits.

    Example:
        >>> from docs.generate.peers import digits
        >>> digits(1234.0), digits(0.0123), digits(2.9e-11), digits(None)
        ('1,200', '0.012', '3e-11', 'not reached')
    """
    if number is None:
        return NEVER
    if number and abs(number) < 1e-4:
        return f"{number:.0e}"
    rounded = float(f"{number:.2g}")
    return f"{rounded:,.0f}" if rounded >= 10.0 else f"{rounded:g}"


# --- gradients -----------------------------------------------------------------------------------


def _gradients(found: dict[str, Any]) -> str:
    level = found["level"]
    head = ("shadow", "for the", "way", "its best error", "its time there, over ours",
            f"its time at an error of {100 * level:g} %, over ours")  # fmt: skip
    rows, ours, known = [], [], []
    for name, shadow in found["shadows"].items():
        for question, asked in shadow["questions"].items():
            own = asked["ours"]
            ours.append(own)
            known.append(asked["reference error"])
            rows.append((name, question, f"**{own['way']}**", digits(own["error"]), "1", "1"))
            for way, said in asked["said"].items():
                cells = (said["error"], said["times ours"], said["times ours at the level"])
                rows.append((name, question, way, *map(digits, cells)))
    seconds = sorted(1e6 * row["seconds"] for row in ours)
    first = sorted(row["first"] * found["places"] for row in ours)
    words = (
        "Irradiance of a floor in the half-shadow of "
        + "; ".join(shadow["words"] for shadow in found["shadows"].values())
        + ", under a square lamp, and how it changes as the place moves (receiver) or as the first "
        "body does (blocker). Errors are RMS over "
        f"{found['places']} places over the RMS of the gradient. Truth is adaptive quadrature of "
        "rows of the lamp, differenced twice; it shares no code with any of these, and its own "
        f"error is at most {digits(max(known))}. Ours takes {seconds[0]:.0f} to "
        f"{seconds[-1]:.0f} µs a place, called place by place, and its first call "
        f"{first[0]:.1f} to {first[-1]:.1f} s."
    )
    unseen = [name for name in SHADOWS if name not in found["shadows"]]
    words += f" Not measured yet: {', '.join(unseen)}." if unseen else ""
    return "\n\n".join([
        "## Gradient of a soft shadow", words,
        _picture("Error over time of every way, for three shadows", "gradients"),
        md.table(head, rows), _GRADIENTS_READ, _closing(found),
    ])  # fmt: skip


_GRADIENTS_READ = """How to read it:

- *Its best error* is that of the largest budget it was given, or of the step that turned out best,
  as if one knew it; with more samples differences go on falling, by the square root of the samples
  or somewhat better, until single precision stops Mitsuba. So the time at one per cent says more.
- *Mitsuba, differences* has common seeds and stratified points of the lamp. It is the strongest
  rival: a per cent is enough for many uses, and there our lead is the smallest.
- *Mitsuba, direct_projective* makes whole images of derivatives; its time is that of the image over
  its pixels, which share the guiding; the octree, which takes long to build, was tried on the ball
  that moves alone. Its truth is ours, averaged over each pixel. It serves
  meshes of any size and any number of parameters, which nothing else here does.
- *Radiance, gradients of its cache* come from one hemisphere of rays, with the lamp as a glow. They
  are meant for interpolation, and end at an error that more rays do not mend. Radiance has no
  derivative by a blocker.
- *Autodiff of sampled visibility* never sees the edge of a shadow: for a blocker it is zero."""


# --- the cache -----------------------------------------------------------------------------------


def _floor_cache(found: dict[str, Any]) -> str:
    size = found["size"]
    per = "100 x RMS error over the mean"
    rows = [
        (name, f"{row['records']:.0f}", f"{100 * row['error']:.2f} ± {100 * row['spread']:.2f}",
         f"{100 * row['own']:.2f}")
        for name, row in found["rows"].items()
    ]  # fmt: skip
    words = (
        "Once reflected light on the floor of the scene `clutter` (nine boxes, three balls, a "
        f"closed room), by caches that visit the same {size['pixels']} x {size['pixels']} places "
        f"in the same {size['orders']} random orders and gather {size['rays']} rays for each "
        "record: value, gradient and radius are of these rays alone."
    )
    known = found["truth known to"]
    told = "" if known is None else (
        f"Records of Radiance with 16 times the rays are {100 * known:.2f} % from our truth, which "
        "is how well it is known. "
    )  # fmt: skip
    return "\n\n".join([
        "## An irradiance cache, at equal gather rays", words,
        _picture("Light on the floor, and the error of each cache", "floor_cache"),
        md.table(("cache", "records", per, "the same of the records alone"), rows),
        told + _cache_read(found["rows"], found["limit"]), _closing(found),
    ])  # fmt: skip


def _cache_read(rows: dict[str, Any], limit: float) -> str:
    """Whether we win, against the goal, and why not by more."""
    theirs = next((row for name, row in rows.items() if name.startswith("Radiance")), None)
    if theirs is None:
        return ""
    best = min((row for name, row in rows.items() if name.startswith("firstorder")),
               key=lambda row: row["error"])  # fmt: skip
    ratio = best["error"] / theirs["error"]
    return (
        f"Our least error over Radiance's is {ratio:.2f}, where the goal was 0.5. The two follow "
        "the same idea (radii from an occlusion-aware Hessian of a triangulated hemisphere), and "
        "to the first order as many records leave about the same. The Hessian is known from the "
        "same rays; to extrapolate with it leaves less. Most of what is left is not noise: with "
        "values and gradients of fifty times the rays second order would still leave "
        f"{limit / theirs['error']:.2f} of Radiance's error."
    )


# --- paths ---------------------------------------------------------------------------------------


def _one_bounce(found: dict[str, Any]) -> str:
    head = ("scene", "program", "efficiency, over ours", "variance of as many paths, over ours",
            "rays a second, over ours", "answers apart")  # fmt: skip
    rows = []
    for name, programs in found["scenes"].items():
        ours = programs[0]
        for row in programs:
            alike = row["rays a second"] is not None
            paths = (
                (row["error"] / ours["error"]) ** 2,
                row["rays a second"] / ours["rays a second"],
            ) if alike else ()  # fmt: skip
            cells = [digits(number) for number in paths] or ["", ""]
            rows.append((name, row["program"], digits(row["efficiency over ours"]), *cells,
                         digits(row["apart"])))  # fmt: skip
    words = (
        "Irradiance at four places of a floor, direct and reflected once, "
        f"{found['paths']:,} paths at a time. Efficiency is one over variance times seconds: twice "
        "the efficiency takes half the time to the same standard error. Radiance gathers a "
        "hemisphere of single reflections instead of paths. The last column is how far the means "
        "lie apart, relative."
    )
    return "\n\n".join(["## One bounce of path tracing", words, md.table(head, rows),
                        _bounce_read(found["scenes"]), _closing(found)])  # fmt: skip


def _bounce_read(scenes: dict[str, Any]) -> str:
    """Where we lose, and why."""
    lost = [
        f"{row['program']} in {name} ({digits(row['efficiency over ours'])} times)"
        for name, programs in scenes.items()
        for row in programs[1:]
        if row["efficiency over ours"] > 1.0
    ]
    if not lost:
        return "Ours is the most efficient in every scene."
    return (
        f"We lose to {', '.join(lost)}. Mitsuba's stratified sampler leaves far less variance on "
        "so few dimensions, where our paths are independent; its loops are compiled for the "
        "processor's vectors in single precision, over a hierarchy of shapes, where ours look at "
        "every shape in double. Our path tracer is the brute-force reference of the exact methods: "
        "it shares no code with them, and independent paths are what its z-tests need."
    )


# --- flatland ------------------------------------------------------------------------------------


def _flatland_hits(found: dict[str, Any]) -> str:
    head = ("precision", "segments", "NumPy's time over ours", "numba's time over ours")
    rows = []
    for row in found["rows"]:
        cells = []
        for peer in ("numpy", "numba"):
            times = row["times ours"].get(peer)
            cells.append(
                "" if times is None else f"{times[0]:.2f} ({times[1]:.2f} to {times[2]:.2f})"
            )
        rows.append((row["precision"], str(row["segments"]), *cells))
    words = (
        f"The nearest of many short segments along each of {found['rays']:,} rays, by the search "
        "that one would write in each; medians with quartiles."
    )
    return "\n\n".join(["## Nearest hits in flatland", words, md.table(head, rows),
                        _hits_read(found["rows"]), _closing(found)])  # fmt: skip


def _hits_read(rows: list[dict[str, Any]]) -> str:
    lost = [
        f"{row['segments']} segments in {row['precision']} ({peer})"
        for row in rows
        for peer, times in row["times ours"].items()
        if times[0] < 1.0
    ]
    if not lost:
        return "Ours is the fastest in every row."
    return (
        f"We lose with {', '.join(lost)}: where a ray meets few segments the work of a call is "
        "moving the rays."
    )
