"""What the library is known not to do, and why: the one list of what the fuzzer does not report.

What stands here is counted and shown, and is no failure. A line whose limit is mended goes.
"""

from __future__ import annotations

import fnmatch
from typing import NamedTuple

import numpy as np


class Limit(NamedTuple):
    """Something that is known to fail; patterns as a shell has them.

    Attributes:
        world: name of it.
        precision: name of it.
        name: of the class of scenes.
        kind: of the finding.
        reason: why.
        most: by how much it may be wrong for this reason.
    """

    world: str
    precision: str
    name: str
    kind: str
    reason: str
    most: float = np.inf


SMALL = "in space float64 is wrong for lengths below 1e-13, as a tiny scene in another unit has"
EDGES = "in space edges within 1e-11 of each other, as a share of their distance, are taken for one"
SINGLE = "in space float32 takes edges within 1e-5 of each other for one: light is off, or NaN"
NEAR = "in float32 a receiver within rounding of a shape is on either side of it"
GRID = "balls on a grid that touch an edge: light changes by the square root of a rounding"
HAIR = "in float32 a receiver within some dozens of roundings of an end mistakes where it is"
ENDS = "an arc hides light some roundings beyond its ends, and if it has no length too"
SPAN = "in float32 lengths from 1e-5 to 1e8 in one scene leave the range of a Hessian's products"
BODIES = "a traced lamp through whose inside a body goes: no edge tells that light is wrong"
PLANE = "a receiver within 1e-12 of a triangle may see what is behind it"
BESIDE = "beside a box digits are lost: a lamp in two shines otherwise by 1e-10"
THIN = "a lamp or a triangle a million times as long as wide loses digits of the light"
TIES = "where three edges coincide, or two at one distance, the derivatives by their things mix"
SQUARES = "in float32 Hessians overflow where lengths are below 1e-8"
FAR_LINES = "in float32 planes all but parallel meet in a line known to a rounding over their angle"
POINTS = "a circle of 1e-10 loses digits of its Hessian"

CHANGES = "order", "mirror", "turn", "shift", "split", "power_of_*"
LIMITS = (
    Limit("flatland", "float32", "without_length", "hessian", SQUARES),
    Limit("flatland", "float32", "near_an_end", "hessian", SQUARES),
    Limit("flatland", "float32", "tiny", "hessian", SQUARES),
    Limit("flatland", "float32", "near_an_end", "scaled gradient", HAIR),
    Limit("flatland", "float32", "near_an_end", "shifted gradient", HAIR),
    Limit("flatland", "float32", "near_an_end", "shift", HAIR, 0.2),
    Limit("flatland", "float32", "without_length", "shift", ENDS, 1e-3),
    Limit("flatland", "float32", "mixed_sizes", "hessian", SPAN),
    Limit("flatland", "float32", "mixed_sizes", "shifted gradient", SPAN),
    Limit("flatland", "float64", "without_length", "second digits", POINTS),
    *(
        Limit("flatland", "float64", name, kind, TIES)
        for name in ("shared_ends", "on_one_line", "in_line", "equal")
        for kind in ("differences", "first digits", "second digits")
    ),
    Limit("space", "float64", "edges_in_line", "differences", TIES),
    *(
        Limit("space", precision, "quarters", kind, GRID, most)
        for precision, most in (("float64", 1e-7), ("float32", 0.01))
        for kind in ("rays", *CHANGES)
    ),
    Limit("space", "*", "lamp_in_a_body", "*", BODIES),
    Limit("space", "float64", "near_a_box", "split", BESIDE),
    Limit("space", "float64", "near_a_triangle", "*", PLANE),
    Limit("space", "*", "sliver", "*", THIN),
    Limit("space", "float64", "tiny", "power_of_*", SMALL),
    Limit("space", "float32", "near_*", "*", NEAR),
    *(
        Limit("space", "float32", "planes_that_meet", kind, FAR_LINES)
        for kind in ("nan", "rays", *CHANGES)
    ),
    *(
        Limit("space", "float32", name, kind, SINGLE)
        for name in ("edge_on", "edges_in_line", "equal", "horizon", "in_line", "lamp_on_a_wall")
        for kind in ("bounds", "rays", *CHANGES)
    ),
    *(Limit("space", "float64", "*", kind, EDGES, 2e-11) for kind in ("rays", *CHANGES)),
    *(Limit("space", "float32", "*", kind, SINGLE, 1e-4) for kind in ("bounds", "rays", *CHANGES)),
)


def known(world: str, precision: str, name: str, kind: str, amount: float) -> Limit | None:
    """The limit that a finding is known by; None if it is news."""
    for limit in LIMITS:
        pairs = zip(limit[:4], (world, precision, name, kind), strict=True)
        within = not amount > limit.most  # NaN where there is no such number
        if within and all(fnmatch.fnmatchcase(given, pattern) for pattern, given in pairs):
            return limit
    return None
