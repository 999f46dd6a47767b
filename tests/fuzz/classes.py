"""Classes of nasty scenes by name: each puts what is nasty into scenes of a general kind."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

Make = Callable[[Any, Any], None]


class Classes(dict[str, Make]):
    """Functions of scenes and a generator of random numbers, by their names."""

    def nasty(self, make: Make) -> Make:
        """Lists a class under the name of its function."""
        self[make.__name__] = make
        return make
