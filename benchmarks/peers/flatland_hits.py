"""Nearest hits in flatland: ours beside NumPy and numba, as one would write the search in each."""

from __future__ import annotations

from typing import Any

from benchmarks import bench_flatland as forms
from benchmarks.peers import measure

SIZES, RAYS, ROUNDS = (4, 64, 512), 1 << 16, 5
PEERS = ("numpy", "numba")


def run(quick: bool) -> dict[str, Any]:
    """Times of each peer over ours, for some numbers of segments in both precisions."""
    sizes, rays, rounds = ((4,), 1 << 11, 1) if quick else (SIZES, RAYS, ROUNDS)
    rows = []
    for dtype in ("float32", "float64"):
        for count in sizes:
            calls = forms.contenders(dtype, count, rays)
            asked = {name: calls[name] for name in ("ours", *PEERS) if name in calls}
            spent = measure.in_turns(asked, rounds)
            ours = spent["ours"].median
            over = {name: [t / ours for t in spent[name]] for name in PEERS if name in spent}
            rows.append({"precision": dtype, "segments": count, "times ours": over,
                         "tests a second": count * rays / ours})  # fmt: skip
    left = [] if measure.is_there("numba") else [measure.missing("numba")]
    return {"rows": rows, "rays": rays, "rounds": rounds, "left out": left}
