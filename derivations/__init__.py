"""Proofs: one runnable module per topic, gathered by `python -m derivations`."""

import pathlib

from derivations.catalogue import load
from firstorder.ledger import Ledger, gather


def table() -> Ledger:
    """Every equation of the catalogue with its row, or an empty row that says "not yet"."""
    return gather(pathlib.Path(__file__).parent, load())
