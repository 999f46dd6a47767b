"""What the fuzzer found: counted by kind, known limits apart, with commands that repeat it.

A case has a name, such as `flatland/float64/near_a_wall/0/1234`: world, precision, class, seed and
number; of files `files/svg/0/17`, of kills `kills/render/0/2`.
"""

from __future__ import annotations

import collections
import math

from tests.fuzz.limits import Limit

SHOWN = 3  # cases of a kind, the worst ones


class Tally:
    """Counts of what was asked and of what is wrong."""

    def __init__(self) -> None:
        self.asked: collections.Counter[str] = collections.Counter()
        self._found: dict[tuple[str, str, Limit | None], list[tuple[float, str]]] = {}

    def add(self, where: str, kind: str, amount: float, case: str, limit: Limit | None) -> None:
        """Counts something that is wrong.

        Args:
            where: part, precision and class.
            kind: what was checked.
            amount: by how much it is wrong; NaN where there is no such number.
            case: its name.
            limit: by which it is known, if it is.
        """
        worst = -math.inf if math.isnan(amount) else amount
        self._found.setdefault((where, kind, limit), []).append((worst, case))

    @property
    def failures(self) -> int:
        """How many things are wrong that are not known."""
        return sum(len(cases) for (*_, limit), cases in self._found.items() if limit is None)

    @property
    def lines(self) -> list[str]:
        """All of it in words."""
        said = [f"asked: {count} of {part}" for part, count in sorted(self.asked.items())]
        for (where, kind, limit), cases in sorted(
            self._found.items(), key=lambda item: item[0][:2]
        ):
            worst = sorted(cases, reverse=True)[:SHOWN]
            by = f", by {worst[0][0]:.2g} at most" if math.isfinite(worst[0][0]) else ""
            mark = "known" if limit else "WRONG"
            said.append(f"{mark}: {where}: {kind}: {len(cases)}{by}")
            if limit is None:
                said += [f"    make fuzz CASE={case}" for _, case in worst]
            else:
                said.append(f"    {limit.reason}: {worst[0][1]}")
        return [*said, f"{self.failures} failures"]
