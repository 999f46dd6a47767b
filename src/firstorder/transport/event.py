"""Events, chains of events, and paths (`source >> event >> event`) with portraits at each step."""

from __future__ import annotations

import abc
import contextlib
from collections.abc import Iterator, Sequence
from typing import Any

from firstorder._argument_checks import check_kind
from firstorder._display import Figure, Module, in_notebook, strip
from firstorder.conventions import Frame
from firstorder.errors import Refused
from firstorder.fields.covariance import Covariance
from firstorder.fields.field import Field
from firstorder.fields.jet import Jet
from firstorder.fields.spectrum import Grid, Spectrum
from firstorder.fields.wavelet import Wavelet
from firstorder.laws.base import Law, Portrait
from firstorder.laws.warp import Warp
from firstorder.typing import Ray, as_float


class Event(Module):
    """A physical step. `event(portrait)` is the light after it, drawn the same way."""

    _repr_markdown_ = in_notebook

    @abc.abstractmethod
    def law(self, frame: Frame) -> Law:
        """The law for light in this frame; raises `ValueError` if the frame does not fit."""

    def __call__(self, portrait: Portrait) -> Portrait:
        """Apply the event to any portrait."""
        if isinstance(portrait, Jet):
            raise Refused("a jet at one ray needs that ray: use push(jet, u)")
        if not hasattr(portrait, "frame"):
            raise TypeError(
                f"{type(self).__name__} acts on light, a field or another portrait, and not on a "
                f"{type(portrait).__name__}: make it a field first, as `Function` does."
            )
        return self.law(portrait.frame)(portrait)

    def push(self, jet: Jet, u: Ray) -> Jet:
        """Jet after the event at the ray `u`, from the numbers before it."""
        return self.law(jet.frame).push(jet, as_float(u))

    def __rshift__(self, other: Event | Chain) -> Chain:
        """`event >> event`: a chain, to be met by light later."""
        return Chain((self,)) >> other

    def __rrshift__(self, source: Field):
        """`source >> event`: the path that begins at the source and meets this event first."""
        return source >> Chain((self,))

    def linearised(self, at: Ray, radius=0.1) -> Linearised:
        """The event with its warp replaced by a move at the ray `at`; spectra then pass."""
        return Linearised(self, at, radius)


class Chain(Module):
    """Events in the order in which light meets them, without light yet.

    Example:
        >>> from firstorder.transport import Chain, Curvature, Mirror
        >>> chain = Curvature(0.1) >> Mirror() >> Curvature(0.1, back=True)
        >>> isinstance(chain, Chain), len(chain.events)
        (True, 3)
    """

    events: tuple[Event, ...]

    _repr_markdown_ = in_notebook

    def __call__(self, portrait: Portrait) -> Portrait:
        """Every event in turn, on a portrait of any kind."""
        for k, event in enumerate(self.events, 1):
            with _numbered(k, event):
                portrait = event(portrait)
        return portrait

    def __rshift__(self, other: Event | Chain) -> Chain:
        """One more event, or all of another chain's."""
        check_kind("other", other, (Event, Chain), "an event or a chain of them")
        return Chain(self.events + (other.events if isinstance(other, Chain) else (other,)))

    def __rrshift__(self, source: Field):
        """`source >> chain`: a path."""
        return Path(source, self)


class Linearised(Event):
    """An event whose warp is replaced by the move that touches it at one ray.

    Everything passes through it, with an error of second order in the distance from that ray,
    measured by `error`.

    Attributes:
        event: whose law is a warp.
        ray: where the move touches it.
        radius: at which `error` is measured [units of the coordinates].
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


@contextlib.contextmanager
def _numbered(k: int, event: Event):
    """Context in which a refusal says which event of the path it was."""
    try:
        yield
    except (Refused, TypeError, ValueError) as error:
        error.add_note(f"This is event {k} of the path, {type(event).__name__}.")
        raise


def require_frame(condition: bool, event: Event, frame: Frame, need: str) -> None:
    """Refuse a frame that the event does not know how to act on.

    Args:
        condition: whether the event knows the frame.
        event: that asks.
        frame: of the light.
        need: what the event needs, in words.

    Raises:
        ValueError: if it does not.

    Example:
        >>> from firstorder.conventions import FLATLAND
        >>> from firstorder.transport import Mirror, require_frame
        >>> require_frame(FLATLAND.sense == "incoming", Mirror(), FLATLAND, "incoming light")
    """
    if not condition:
        name = type(event).__name__
        raise ValueError(
            f"{name} needs {need}, but the light is {frame.sense} in {frame.coordinates}."
        )


class Path(Module):
    """`source >> event >> event ...`.

    Step 0 is the source; step k is the light after the k-th event.

    Raises:
        TypeError: if the source is no field.

    Example:
        >>> from firstorder.conventions import FLATLAND_SLOPE
        >>> from firstorder.fields import gaussian
        >>> from firstorder.transport import Path, Travel
        >>> path = Path(gaussian((0.0, 0.0), (1.0, 0.1), frame=FLATLAND_SLOPE)) >> Travel(2.0)
        >>> path.light(2.0, 1.0).item() == path.steps[0](0.0, 1.0).item()
        True
    """

    source: Field
    chain: Chain = Chain(())

    _repr_markdown_ = in_notebook

    def __check_init__(self):
        """Refuse what is no light field, as an event in its place or a list of steps."""
        if not isinstance(self.source, Field):
            raise TypeError(
                f"Argument `source` must be a field, but is a {type(self.source).__name__}: write "
                "Path(source) >> event >> event."
            )

    def __rshift__(self, other: Event | Chain) -> Path:
        """The path with one more event, or a whole chain of them."""
        return Path(self.source, self.chain >> other)

    @property
    def events(self) -> tuple[Event, ...]:
        """Events that the light meets, in order."""
        return self.chain.events

    @property
    def steps(self) -> tuple[Field, ...]:
        """The light field before, between and after the events."""
        fields: list[Field] = [self.source]
        for k, event in enumerate(self.events, 1):
            with _numbered(k, event):
                fields.append(event(fields[-1]))
        return tuple(fields)

    @property
    def light(self) -> Field:
        """The light field at the end."""
        return self.steps[-1]

    def __call__(self, *coordinates: Any, with_error: bool = False) -> Any:
        """Radiance at the end, `path.light(*coordinates)`.

        Args:
            coordinates: of the light at the end, in the order of its frame; they broadcast.
            with_error: as for a field.

        Example:
            >>> from firstorder.conventions import FLATLAND_SLOPE
            >>> from firstorder.fields import gaussian
            >>> from firstorder.transport import Travel
            >>> path = gaussian((0.0, 0.0), (1.0, 1.0), frame=FLATLAND_SLOPE) >> Travel(2.0)
            >>> round(path(2.0, 1.0).item(), 6)  # exp(-1/2)
            0.606531
        """
        return self.light(*coordinates, with_error=with_error)

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

    def jets(self, u: Ray, *others: Any) -> tuple[Jet, ...]:
        """Jet of every step at the same coordinates `u`, those of that step.

        Raises:
            TypeError: for coordinates one by one, of which a field makes many rays.
        """
        if others:
            raise TypeError(
                "Argument `u` of Path.jets must be one ray, but is its coordinates one by one: "
                "write jets([x, v])."
            )
        return tuple(f.jet(u) for f in self.steps)

    def plot(
        self,
        *,
        window: Grid | None = None,
        rows: Sequence[str] = ("value", "gradient", "spectrum"),
    ) -> Figure:
        r"""Draws a strip: a column for each step from the source to the end, a row for a portrait.

        Steps over the same coordinates have the same axes, which hold the light and the energy of
        all of them, and a row has one scale. A spectrum without a closed form is the transform of
        the samples in the window, and says so. `plotting.portrait_strip` draws chosen steps under
        names of your own.

        Args:
            window: where light is sampled, in the coordinates of every step; if left out, where
                the light is, as for `Field.plot`.
            rows: of "value", "gradient", "dx", "dtheta" (its parts) and "spectrum".

        Returns:
            A figure, whose `savefig` writes it; no window opens.

        Raises:
            ValueError: if the light of a step is not over two coordinates, if the path holds no
                numbers, or for another row.

        Example:
            >>> from firstorder.conventions import FLATLAND_SLOPE
            >>> from firstorder.fields import gaussian
            >>> from firstorder.transport import Travel
            >>> path = gaussian((0.0, 0.0), (1.0, 0.1), frame=FLATLAND_SLOPE) >> Travel(2.0)
            >>> [ax.get_title(loc="left") for ax in path.plot(rows=["spectrum"]).axes]
            ['source', 'Travel']
        """
        return strip(self, window=window, rows=rows)

    def _walk(self, portrait) -> Iterator[Any]:
        """The portrait at every step; once refused, it stays refused for the same reason."""
        yield portrait
        for k, event in enumerate(self.events, 1):
            if not isinstance(portrait, Refused):
                portrait = _or_refusal(lambda p=portrait, e=event: e(p))
                if isinstance(portrait, Refused):
                    name, reason = type(event).__name__, portrait.reason
                    said = reason if reason.startswith(f"{name} ") else f"{name}: {reason}"
                    portrait = Refused(f"event {k} of the path, {said}")
            yield portrait


def _or_refusal(make):
    """The portrait, or the refusal."""
    try:
        return make()
    except Refused as refusal:
        return refusal
