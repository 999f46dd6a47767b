"""What happens to light: an event picks a law and its parameters, and cites its equation."""

from __future__ import annotations

import abc

import equinox as eqx

from firstorder.conventions import Frame
from firstorder.errors import Refused
from firstorder.fields.field import Field
from firstorder.fields.jet import Jet
from firstorder.laws.base import Law, Portrait
from firstorder.laws.warp import Warp
from firstorder.typing import Ray


class Event(eqx.Module):
    """A physical step. `event(portrait)` is the light after it, drawn the same way."""

    @abc.abstractmethod
    def law(self, frame: Frame) -> Law:
        """The law for light in this frame; raises `ValueError` if the frame does not fit."""

    def __call__(self, portrait: Portrait) -> Portrait:
        """Apply the event to any portrait."""
        if isinstance(portrait, Jet):
            raise Refused("a jet at one ray needs that ray: use push(jet, u)")
        return self.law(portrait.frame)(portrait)

    def push(self, jet: Jet, u: Ray) -> Jet:
        """Jet after the event at the ray `u`, from the numbers before it."""
        return self.law(jet.frame).push(jet, u)

    def __rshift__(self, other: Event | Chain) -> Chain:
        """`event >> event`: a chain, to be met by light later."""
        return Chain((self,)) >> other

    def __rrshift__(self, source: Field):
        """`source >> event`: the path that begins at the source and meets this event first."""
        return source >> Chain((self,))

    def linearised(self, at: Ray, radius=0.1) -> Linearised:
        """The event with its warp replaced by a move at the ray `at`; spectra then pass."""
        return Linearised(self, at, radius)


class Chain(eqx.Module):
    """Events in the order in which light meets them, without light yet.

    Example:
        >>> from firstorder.transport import Curvature, Mirror
        >>> len((Curvature(0.1) >> Mirror() >> Curvature(0.1, back=True)).events)
        3
    """

    events: tuple[Event, ...]

    def __call__(self, portrait: Portrait) -> Portrait:
        """Every event in turn, on a portrait of any kind."""
        for event in self.events:
            portrait = event(portrait)
        return portrait

    def __rshift__(self, other: Event | Chain) -> Chain:
        """One more event, or all of another chain's."""
        return Chain(self.events + (other.events if isinstance(other, Chain) else (other,)))

    def __rrshift__(self, source: Field):
        """`source >> chain`: a path."""
        from firstorder.transport.path import Path  # paths are made of events

        return Path(source, self)


class Linearised(Event):
    """An event whose warp is replaced by the move that touches it at one ray.

    Everything passes through it, with an error of second order in the distance from that ray,
    measured by `error`.
    """

    event: Event
    ray: Ray
    radius: float = 0.1

    def law(self, frame: Frame) -> Law:
        """The touching move; a law that is not a warp is left as it is."""
        law = self.event.law(frame)
        return law.linearise(self.ray, self.radius).move if isinstance(law, Warp) else law

    def error(self, frame: Frame):
        """Largest displacement of a ray within `radius`, in the coordinates' units."""
        law = self.event.law(frame)
        return law.linearise(self.ray, self.radius).displacement if isinstance(law, Warp) else 0.0


def require(condition: bool, event: Event, frame: Frame, need: str) -> None:
    """Refuse a frame that the event does not know how to act on."""
    if not condition:
        name = type(event).__name__
        raise ValueError(
            f"{name} needs {need}, but the light is {frame.sense} in {frame.coordinates}."
        )
