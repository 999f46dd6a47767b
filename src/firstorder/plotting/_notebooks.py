"""What notebooks show of scenes, their files, fields, spectra and caches: words and a picture.

No figure stays open and no setting changes: figures are made without pyplot, in a context.
"""

from __future__ import annotations

import base64
import html
import io
import warnings
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from firstorder import flatland, space
from firstorder.caching import Cache
from firstorder.fields import Field, Spectrum
from firstorder.io import SpaceFile
from firstorder.plotting._plot_caches import check_cache
from firstorder.plotting._plot_methods import draw
from firstorder.plotting.style import house_style

MOST = 22_000  # bytes of a picture, 30 kB as text
COLOURS = (256, 128, 64, 32, 16)  # as many as fit
SHAPES = 2000  # of a scene, and
EQUATIONS = 1000  # of a program for one ray, beyond which only `plot` draws: it takes seconds
SIZE = 64  # samples along both axes of an image


def in_html(thing: Any) -> str:
    """Words and a small picture; the words alone where there is none."""
    words = html.escape(told(thing))
    kept = "white-space: pre; font-family: monospace; line-height: 1.3"
    return f'<div><div style="{kept}">{words}</div>{image(thing)}</div>'


def image(thing: Any) -> str:
    """An image element that holds the picture itself, or nothing if there is no picture."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            pixels = _pixels(thing)
    except Exception:  # a notebook shows what there is to show, and never a traceback instead
        return ""
    data = base64.b64encode(_png(pixels)).decode()
    width = pixels.width // 2  # twice the pixels, for fine screens
    return f'<img width="{width}" alt="{type(thing).__name__}" src="data:image/png;base64,{data}">'


def _pixels(thing: Any) -> Image.Image:
    """The picture, at two pixels for one."""
    views: list[dict[str, Any]] = [{}]
    if isinstance(thing, SpaceFile):
        _check_few("triangles", sum(model.mesh.count for model in thing.models), SHAPES)
        thing = thing.scene
    match thing:
        case flatland.Scene() | space.Scene():
            _check_few("shapes", len(thing.names), SHAPES)
            if isinstance(thing, space.Scene):
                views = [{"view": "top"}, {"view": "front"}]
        case Field() | Spectrum():
            ray = jax.ShapeDtypeStruct((thing.frame.dims,), jnp.result_type(float))
            _check_few("equations", _equations(jax.make_jaxpr(thing.at)(ray)), EQUATIONS)
            views = [{"size": SIZE}] if thing.frame.dims == 2 else views
        case Cache():
            views = [{"size": SIZE}] if thing.records.dims == 2 else views
    with house_style():
        figure = Figure(figsize=(3.4 * len(views), 2.6), dpi=200, layout="constrained")
        canvas = FigureCanvasAgg(figure)
        panels = figure.subplots(1, len(views), squeeze=False)
        for ax, options in zip(panels.flat, views, strict=True):
            draw(ax, thing, **options)
        canvas.draw()
        return Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3])


def _check_few(what: str, count: int, most: int) -> None:
    """Refuse what would keep a notebook waiting."""
    if count > most:
        raise ValueError(f"A notebook draws at most {most} {what} unasked, but here are {count}.")


def _equations(program: Any) -> int:
    """How many operations a program has, those of its loops and branches counted once."""
    inner = getattr(program, "jaxpr", program)
    if not hasattr(inner, "eqns"):
        return 0
    parts = [part for eqn in inner.eqns for part in eqn.params.values()]
    parts = [p for part in parts for p in (part if isinstance(part, tuple) else (part,))]
    return len(inner.eqns) + sum(map(_equations, parts))


def _png(pixels: Image.Image) -> bytes:
    """The file, of as many colours as a notebook has room for."""
    found = b""
    for colours in COLOURS:
        file = io.BytesIO()
        fewer = pixels.quantize(colours, Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
        fewer.save(file, "png", optimize=True)
        found = file.getvalue()
        if len(found) <= MOST:
            break
    return found


def told(thing: Any) -> str:
    """Words for a thing, in a line or a few."""
    match thing:
        case Field() | Spectrum():
            names = ", ".join(thing.frame.coordinates)
            return f"{type(thing).__name__.lstrip('_')} of {thing.frame.sense} light over ({names})"
        case Cache():
            try:
                check_cache(thing)
            except ValueError as reason:
                return f"Cache: {reason}"
            return _records(thing)
    return repr(thing)


def _records(cache: Cache) -> str:
    """How many records, where, and how far they reach."""
    x, R = np.asarray(cache.records.position), np.asarray(cache.region.radius)
    spans = zip("xy", x.min(0), x.max(0), strict=False)
    where = ", ".join(f"{axis} {low:.3g} to {high:.3g} m" for axis, low, high in spans)
    kind = "along a line" if cache.records.dims == 1 else "on a plane"
    return (
        f"Cache of {cache.count} records {kind}, order {cache.order}\n"
        f"  {where}; radius {R.min():.3g} to {R.max():.3g} m"
    )
