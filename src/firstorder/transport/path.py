"""Paths: events in the order in which light meets them, with every portrait at every step."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import equinox as eqx

from firstorder.errors import Refused
from firstorder.fields.covariance import Covariance
from firstorder.fields.field import Field
from firstorder.fields.jet import Jet
from firstorder.fields.spectrum import Grid, Spectrum
from firstorder.fields.wavelet import Wavelet
from firstorder.transport.event import Chain, Event
from firstorder.typing import Ray


class Path(eqx.Module):
    """`source >> event >> event ...`.

    Step 0 is the source; step k is the light after the k-th event.

    Example:
        >>> from firstorder.conventions import FLATLAND_SLOPE
        >>> from firstorder.fields import gaussian
        >>> from firstorder.transport import Travel
        >>> path = gaussian((0.0, 0.0), (1.0, 0.1), frame=FLATLAND_SLOPE) >> Travel(2.0)
        >>> path.light(2.0, 1.0).item() == path.steps[0](0.0, 1.0).item()
        True
    """

    source: Field
    chain: Chain = Chain(())

    def __rshift__(self, other: Event | Chain) -> Path:
        """The path with one more event, or a whole chain of them."""
        return Path(self.source, self.chain >> other)

    @property
    def events(self) -> tuple[Event, ...]:
        """What the light meets, in order."""
        return self.chain.events

    @property
    def steps(self) -> tuple[Field, ...]:
        """The light field before, between and after the events."""
        fields: list[Field] = [self.source]
        for event in self.events:
            fields.append(event(fields[-1]))
        return tuple(fields)

    @property
    def light(self) -> Field:
        """The light field at the end."""
        return self.steps[-1]

    @property
    def spectra(self) -> tuple[Spectrum | Refused, ...]:
        """Spectrum at every step, or the refusal that stopped it."""
        return tuple(self._walk(_or_refusal(self.source.spectrum)))

    @property
    def covariances(self) -> tuple[Covariance | Refused, ...]:
        """Covariance at every step, or the refusal that stopped it."""
        return tuple(self._walk(_or_refusal(self.source.covariance)))

    def wavelets(self, grid: Grid) -> tuple[Wavelet | Refused, ...]:
        """Haar coefficients at every step, or the refusal that stopped them.

        Args:
            grid: cells of the source's samples, 2^k along each axis.
        """
        return tuple(self._walk(Wavelet.of(self.source, grid)))

    def jets(self, u: Ray) -> tuple[Jet, ...]:
        """Jet of every step at the same coordinates `u`, those of that step."""
        return tuple(f.jet(u) for f in self.steps)

    def _walk(self, portrait) -> Iterator[Any]:
        """The portrait at every step; once refused, it stays refused for the same reason."""
        yield portrait
        for event in self.events:
            if not isinstance(portrait, Refused):
                portrait = _or_refusal(lambda p=portrait, e=event: e(p))
            yield portrait


def _or_refusal(make):
    """The portrait, or why there is none."""
    try:
        return make()
    except Refused as refusal:
        return refusal
