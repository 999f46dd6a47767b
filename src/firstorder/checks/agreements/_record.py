"""One number, found in several independent ways: rows of a table that can be read, and judged.

A row holds what one way says of one quantity, how far that is from the reference, and the bound by
which it is judged. A bound is computed from what the way knows of itself: rounding and conditioning
of a closed form, the step of a quadrature, the standard error of random numbers. It never depends
on the error that it judges.
"""

from __future__ import annotations

import dataclasses
import math
import textwrap
from collections.abc import Callable, Iterable, Iterator
from typing import Literal, TypeVar

from firstorder._labelled import DataFrame, data_frame
from firstorder.errors import Refused

Verdict = Literal["reference", "agrees", "differs", "refused"]
Answer = TypeVar("Answer")
WIDTH = 100  # columns of a terminal


@dataclasses.dataclass(frozen=True)
class Found:
    """Answer of one way to one quantity, not judged yet.

    Attributes:
        value: the number.
        bound: the largest error that its own arithmetic and step explain; with a standard error,
            the part of it that is not random.
        spread: standard error of a random estimate, 0 for what is not random.

    Example:
        >>> from firstorder.checks.agreements import Found
        >>> Found(0.894, bound=1e-3).spread
        0.0
    """

    value: float
    bound: float
    spread: float = 0.0


@dataclasses.dataclass(frozen=True)
class Row:
    """Answer of one way to one quantity, judged.

    Attributes:
        quantity: such as `E'`.
        way: how it was found.
        value: the number; None if the way refused.
        error: its distance from the reference; None for the reference and for a refusal.
        bound: the largest distance that agrees.
        spread: standard error if the way is random, else 0.
        z: of a random way, what of the error its step does not explain, in standard errors.
        verdict: "reference", "agrees", "differs" or "refused".
        reason: of a refusal, in words a user can act on.
    """

    quantity: str
    way: str
    value: float | None = None
    error: float | None = None
    bound: float | None = None
    spread: float = 0.0
    z: float | None = None
    verdict: Verdict = "refused"
    reason: str = ""


@dataclasses.dataclass(frozen=True)
class Agreements:
    """One scene in all ways: a table of numbers that should be the same, and are or are not.

    Attributes:
        title: scene and receiver.
        rows: in the order of quantities and ways.
        notes: what a reader should know of the table.

    Example:
        >>> from firstorder.checks.agreements import Agreements, Found, judged
        >>> ways = {"closed form": Found(1.0, 1e-15), "differences": Found(1.001, 1e-6)}
        >>> table = Agreements("a scene", judged("E", ways, "closed form"))
        >>> table.agrees, [row.way for row in table.differing]
        (False, ['differences'])
    """

    title: str
    rows: tuple[Row, ...]
    notes: tuple[str, ...] = ()

    @property
    def agrees(self) -> bool:
        """Whether nothing differs."""
        return not self.differing

    @property
    def differing(self) -> tuple[Row, ...]:
        """Rows whose error is beyond their bound."""
        return tuple(row for row in self.rows if row.verdict == "differs")

    def row(self, quantity: str, way: str) -> Row:
        """The row of a quantity and a way (by how its name begins).

        Raises:
            ValueError: if there is none.
        """
        for row in self.rows:
            if row.quantity == quantity and row.way.startswith(way):
                return row
        raise ValueError(f"Arguments `quantity` and `way` must name a row, not {quantity}, {way}.")

    def columns(self) -> dict[str, list]:
        """The table by column, ready for `firstorder.io.write_csv`."""
        names = [field.name for field in dataclasses.fields(Row)]
        return {name: [getattr(row, name) for row in self.rows] for name in names}

    def to_pandas(self) -> DataFrame:
        """The table as `columns` gives it; what a row does not have is missing.

        Raises:
            ModuleNotFoundError: without the extra `tables`.
        """
        return data_frame(self.columns(), {})

    def __str__(self) -> str:
        """The table for a terminal of 100 columns."""
        return "\n".join(_lines(self))


def judged(
    quantity: str, ways: dict[str, Found | str], reference: str, threshold: float = 4.0
) -> tuple[Row, ...]:
    """Rows of one quantity, each judged against the reference.

    A row agrees if `|value - reference| <= bound + threshold spread + bound of the reference`.

    Args:
        quantity: its name.
        ways: what each says, or the reason why it does not apply.
        reference: the way that the others are held against; one that applies.
        threshold: standard errors that a random way may be off.

    Raises:
        ValueError: if the reference is no way that applies.

    Example:
        >>> from firstorder.checks.agreements import Found, judged
        >>> ways = {"exact": Found(1.0, 1e-12), "sampled": Found(1.2, 0.0, 0.1), "series": "edges"}
        >>> [row.verdict for row in judged("E", ways, "exact")]
        ['reference', 'agrees', 'refused']
    """
    standard = ways.get(reference)
    if not isinstance(standard, Found):
        raise ValueError(f"Argument `reference` must name a way that applies, not {reference!r}.")
    return tuple(_judged(quantity, way, found, reference, standard, threshold)
                 for way, found in ways.items())  # fmt: skip


def _judged(quantity, way, found, reference, standard: Found, threshold) -> Row:
    if isinstance(found, str):
        return Row(quantity, way, reason=found)
    if way == reference:
        verdict: Verdict = "reference" if math.isfinite(found.value) else "differs"
        return Row(quantity, way, found.value, None, found.bound, 0.0, None, verdict)
    error = abs(found.value - standard.value)
    steps = found.bound + standard.bound
    bound = steps + threshold * found.spread
    z = max(error - steps, 0.0) / found.spread if found.spread else None
    # A NaN on either side is no agreement.
    verdict = "agrees" if error <= bound < math.inf else "differs"
    return Row(quantity, way, found.value, error, bound, found.spread, z, verdict)


def attempted(ask: Callable[[], Answer]) -> Answer | str:
    """Answer of a function, or the reason of its refusal."""
    try:
        return ask()
    except Refused as refusal:
        return refusal.reason


# --- print ---------------------------------------------------------------------------------------


def _lines(table: Agreements) -> Iterator[str]:
    yield table.title
    yield f"{'':38}{'value':>20}{'error':>10}{'bound':>10}{'z':>7}  verdict"
    shown = [row for row in table.rows if row.verdict != "refused"]
    before = None
    for row in shown:
        if row.quantity != before:
            yield row.quantity
            before = row.quantity
        z = "" if row.z is None else f"{row.z:.1f}"
        error = "" if row.error is None else f"{row.error:.1e}"
        yield (
            f"  {row.way:36}{row.value:>20.13g}{error:>10}{row.bound:>10.1e}{z:>7}  {row.verdict}"
        )
    for reason, names in _refusals(table.rows).items():
        yield from _wrapped(f"refused: {reason} ({', '.join(names)})")
    for note in table.notes:
        yield from _wrapped(note)


def _refusals(rows: Iterable[Row]) -> dict[str, list[str]]:
    """Each reason, with the rows that it speaks for: ways, and in which quantities."""
    found: dict[str, dict[str, list[str]]] = {}
    for row in rows:
        if row.verdict == "refused":
            found.setdefault(row.reason, {}).setdefault(row.way, []).append(row.quantity)
    return {
        reason: [f"{way}: {', '.join(quantities)}" for way, quantities in ways.items()]
        for reason, ways in found.items()
    }


def _wrapped(sentence: str) -> list[str]:
    return textwrap.wrap(sentence, WIDTH, subsequent_indent="  ")
