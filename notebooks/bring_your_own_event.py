import marimo

__generated_with = "0.25.2"
app = marimo.App(width="full", app_title="Bring your own event")

with app.setup:
    import time
    from dataclasses import dataclass
    from functools import cached_property

    import equinox as eqx
    import jax
    import jax.numpy as jnp
    import marimo as mo
    import numpy as np
    import sympy

    from firstorder import session
    from firstorder.checks import check
    from firstorder.conventions import FLATLAND, FLATLAND_SLOPE
    from firstorder.errors import Refused
    from firstorder.fields import Grid, discrete_transform, gaussian
    from firstorder.laws import Move, Warp
    from firstorder.plotting import (
        COLOURS,
        LiveFigure,
        house_style,
        label,
        log_magnitude,
        panels,
        show_light_field,
        show_spectrum,
    )
    from firstorder.symbolic import event, lobe, parse_expression
    from firstorder.transport import Chain, Reflection

    session.start(x64=False)  # a picture needs no more digits
    DECADES = 4.0
    LOBE_ANGLE = sympy.Symbol("t")
    # Where each begins: a map of rays, a factor, a lobe, and numbers as low .. start .. high.
    STARTS = {
        "thin lens": ("theta: theta - x / f", "", "", "f: 0.4 .. 0.8 .. 3"),
        "haze": ("", "exp(-s * d / cos(theta))", "", "s: 0 .. 0.3 .. 1; d: 0.2 .. 2 .. 4"),
        "satin lobe": ("", "", "cos(t)**8 * (1 + a * t**2)", "a: 0 .. 0.3 .. 6"),
        "flat interface": ("theta: asin(sin(theta) / n)", "", "", "n: 1 .. 1.5 .. 2.5"),
        "moving blocker": (
            "",
            "1 / (1 + exp((x - v * d - w) / s))",
            "",
            "d: 0 .. 0.7 .. 2; w: -0.5 .. 0.1 .. 0.5; s: 0.03 .. 0.1 .. 0.4",
        ),
    }


@app.cell
def _():
    mo.md(r"""
    # Bring your own event

    Type what happens to light, and see what becomes of it. An event is a **map of rays** (where a ray
    goes), a **factor** (what its radiance is multiplied by) or a **lobe** of the angle $t$ from the
    mirror direction; a map and a factor may stand together. Its formula, its derivatives and its
    spectrum are found from the expression, and a button has them judged as the library's own are.

    Things to try:

    - Move the **ray** (the circle): its jet is drawn over the radiance, first order and second.
    - Give the **thin lens** aberrations, `theta: theta - x / f - x**3`: the map is no longer linear,
      and the closed form of the spectrum is refused with the reason.
    - Make the **satin lobe** a bell, `exp(-t**2 / (2 * s**2))` with `s: 0.05 .. 0.2 .. 0.4`.
    - Type a fold, `theta: theta**2 + x`, or what is no expression.

    Names are $x$ and $\theta$, or $x$ and the slope $v$; the lobe's is $t$; all others are numbers, given
    as *low .. start .. high*. What is typed is never run: text is taken apart by `parse_expression`,
    which knows numbers, these names, `+ - * / **` and common functions, and nothing else.

    Next: [light through a whole path](light_field_path.py), [a scene under the mouse](explorer.py).
    """)
    return


@app.cell
def _():
    # Samples of radiance along each axis.
    size = 96
    return (size,)


@app.cell
def _():
    start = mo.ui.dropdown(list(STARTS), value="thin lens", label="start from")
    return (start,)


@app.cell
def _(start):
    _rays, _factor, _lobe, _numbers = STARTS[start.value]
    texts = mo.ui.dictionary(
        {
            "rays": mo.ui.text(_rays, label="map of rays", full_width=True),
            "factor": mo.ui.text(_factor, label="factor", full_width=True),
            "lobe": mo.ui.text(_lobe, label="lobe", full_width=True),
            "numbers": mo.ui.text(_numbers, label="numbers", full_width=True),
        }
    )
    mo.vstack([start, *texts.values()])
    return (texts,)


@app.cell
def _(start, texts):
    _untouched = tuple(texts.value.values()) == STARTS[start.value]
    built = answer(texts.value, start.value if _untouched else "event")
    mo.stop(isinstance(built, str), mo.callout(built, kind="danger"))
    return (built,)


@app.cell
def _(built):
    _ranges = built.ranges.items()
    sliders = mo.ui.dictionary(
        {
            **{
                n: mo.ui.slider(a, b, (b - a) / 100, value=at, label=n) for n, (a, at, b) in _ranges
            },
            "ray_x": mo.ui.slider(-1.2, 1.2, 0.02, value=0.3, label="the ray's position (m)"),
            "ray_angle": mo.ui.slider(-0.9, 0.9, 0.02, value=-0.2, label="its direction"),
        }
    )
    # Apart from the picture, which they need not wait for.
    mo.hstack(list(sliders.values()), justify="start", wrap=True)
    return (sliders,)


@app.cell
def _(built, png, shown, sliders):
    _numbers = {name: sliders[name].value for name in built.ranges}
    _ray = sliders["ray_x"].value, sliders["ray_angle"].value
    try:
        _picture, _seconds, _jet = png(_numbers, _ray)
        _said = mo.md(f"Redrawn in {1000 * _seconds:.0f} ms; {shown.size} samples along each axis.")
        _seen = [mo.image(_picture, alt="light before and after, spectra, jet"), _said]
        _seen.append(mo.md(_jet._repr_markdown_()))
    except ValueError as _error:  # a lobe whose numbers make it none
        _seen = [mo.callout(str(_error), kind="danger")]
    mo.vstack(_seen)
    return


@app.cell
def _(built):
    mo.md(f"## Its formula\n\n{built.formula()}")
    return


@app.cell
def _():
    judge = mo.ui.run_button(label="judge it: all squares, with faults made on purpose")
    mo.vstack([judge])
    return (judge,)


@app.cell
def _(built, judge):
    mo.stop(not judge.value)
    mo.md(f"```\n{judged(built)}\n```")
    return


@app.class_definition
@dataclass(frozen=True)
class Built:
    """What was typed: the event for numbers, and its light."""

    name: str
    rays: dict
    factor: object
    lobe: object
    ranges: dict

    @property
    def frame(self):
        """Slopes where the text has a slope; light that leaves where a lobe reflects it."""
        typed = [*self.rays.values(), self.factor, self.lobe]
        names = {s.name for e in typed if e is not None for s in e.free_symbols} | set(self.rays)
        frame = FLATLAND_SLOPE if "v" in names else FLATLAND
        return frame if self.lobe is None else frame.turned()

    @property
    def light(self):
        return gaussian((0.1, -0.05), (0.45, 0.28), 0.35, frame=self.frame)

    @property
    def start(self):
        return {name: at for name, (_, at, _) in self.ranges.items()}

    def event(self, numbers):
        """The event with these numbers, or symbols."""
        if self.lobe is not None:
            return Reflection(lobe(self.lobe, LOBE_ANGLE, parameters=numbers))
        rays = self.rays or None
        return event(rays, factor=self.factor, parameters=numbers, name=self.name)

    @cached_property
    def made(self):
        """The event with the numbers that it starts with."""
        return self.event(self.start)

    def moved(self, numbers):
        """The event with other numbers: they are leaves, so nothing is solved or compiled again.

        A lobe is made anew, for numbers say where it ends.
        """
        if self.lobe is not None:
            return self.event(numbers)
        events = self.made.events if isinstance(self.made, Chain) else (self.made,)
        values = {name: jnp.asarray(value, float) for name, value in numbers.items()}
        return Chain(tuple(eqx.tree_at(lambda e: e.parameters, one, values) for one in events))

    def formula(self):
        """What it does to unknown light, in symbols; in numbers where symbols have no end."""
        symbols = {name: sympy.Symbol(name, real=True) for name in self.ranges}
        made = self.event(self.start if self.lobe is not None else symbols)
        return made._repr_markdown_()


@app.function
def answer(texts, name="event"):
    """What was typed as `Built`, or one sentence that says what is wrong with it."""
    try:
        ranges = dict(range_of(part) for part in parts_of(texts["numbers"]))
        names = ["x", "theta", "v", *ranges]
        rays = dict(ray_of(part, names) for part in parts_of(texts["rays"]))
        typed = {k: texts[k] for k in ("factor", "lobe") if texts[k].strip()}
        if not (typed or rays):
            raise ValueError(
                "Nothing happens to light yet: type a map of rays, a factor or a lobe."
            )
        if "lobe" in typed and (rays or "factor" in typed):
            raise ValueError("A lobe stands alone: leave the map of rays and the factor empty.")
        allowed = {"factor": names, "lobe": ["t", *ranges]}
        found = {k: parse_expression(text, allowed[k]) for k, text in typed.items()}
        built = Built(name, rays, found.get("factor"), found.get("lobe"), ranges)
        built.made(built.light)  # it takes this light, and all its names have numbers
    except (ValueError, Refused) as error:
        return str(error)
    return built


@app.function
def parts_of(text):
    """What stands between semicolons."""
    return [part for part in text.split(";") if part.strip()]


@app.function
def named(part, words):
    name, colon, rest = part.partition(":")
    if not colon or not name.strip().isidentifier():
        raise ValueError(f"{part.strip()!r} is not understood: write {words}.")
    return name.strip(), rest


@app.function
def ray_of(part, names):
    """One coordinate of the map."""
    name, text = named(part, "a coordinate, a colon, and where rays go: theta: theta - x / f")
    if name not in ("x", "theta", "v"):
        raise ValueError(f"{name!r} is no coordinate: rays have x and theta, or x and v.")
    return name, parse_expression(text, names)


@app.function
def range_of(part):
    """One number: its range and where it starts."""
    name, text = named(part, "a name, a colon, and low .. start .. high")
    if name in ("x", "theta", "v", "t"):
        raise ValueError(f"{name!r} is a coordinate: call the number otherwise.")
    try:
        low, at, high = map(float, text.split(".."))
    except ValueError:
        raise ValueError(f"{part.strip()!r} is no range: write low .. start .. high.") from None
    if not low <= at <= high or not low < high or not np.isfinite([low, high]).all():
        raise ValueError(f"The numbers of {name} must rise: low .. start .. high.")
    return name, (low, at, high)


@app.function
def judged(built):
    """The table of `check`, in double precision."""
    with jax.enable_x64(True):
        return check(built.event(built.start), built.frame, name=built.name)


@app.class_definition
@dataclass(frozen=True)
class Shown:
    """The samples."""

    size: int
    box = (1.6, 1.3)

    @property
    def grid(self):
        return Grid.spanning((self.size, self.size), self.box)

    @property
    def wide(self):
        """What a sampled spectrum is taken of."""
        return Grid.spanning((2 * self.size, self.size), (3.2, 1.55))

    @property
    def Omega(self):
        return np.linspace(-3.0, 3.0, 3 * self.size // 4 + 1)


@app.function
def followed(made, frame, u):
    """Where the ray u comes from: moves and warps are followed back."""
    events = made.events if isinstance(made, Chain) else (made,)
    for one in reversed(events):
        law = one.law(frame)
        if isinstance(law, Move):
            u = law.preimage(u)
        elif isinstance(law, Warp):
            u = law.map(u)
    return u


@app.function
@eqx.filter_jit
def portraits(shown, light, made, u):
    """All that is drawn, as one compiled function of the numbers and the ray."""
    after, frame = made(light), light.frame
    found = {}
    for name, field in (("before", light), ("after", after)):
        found[name] = field(*jnp.moveaxis(jnp.asarray(shown.grid.points()), -1, 0))
        try:
            spectrum = field.spectrum()
            found[f"F {name}"] = spectrum(*jnp.meshgrid(shown.Omega, shown.Omega, indexing="ij"))
        except Refused:
            samples = jnp.nan_to_num(shown.wide.sample(field))
            found[f"F {name}"] = discrete_transform(samples, shown.wide, shown.Omega, shown.Omega)
    lines = [jnp.stack([jnp.asarray(shown.grid.axis(0)), jnp.full(shown.size, u[1])], -1)]
    lines.append(jnp.stack([jnp.full(shown.size, u[0]), jnp.asarray(shown.grid.axis(1))], -1))
    found["along"] = [after(*line.T) for line in lines]
    return found | {"jet": after.jet(u), "source": followed(made, frame, u)}


@app.function
def spectrum_is_closed(built):
    """Whether the spectrum after the event has a closed form."""
    try:
        built.made(built.light.spectrum())
    except Refused:
        return False
    return True


@app.cell
def _(size):
    shown = Shown(size)
    return (shown,)


@app.cell
def _(built, shown):
    # Drawn once for an event: axes, labels, scales (those of the light before, so changes show).
    _light = built.light
    with mo.status.spinner("Compiling the light before and after, its jet and its spectra ..."):
        _first = portraits(shown, _light, built.moved(built.start), jnp.zeros(2))
    _first = jax.tree.map(np.asarray, _first)
    _names = built.frame.coordinates
    top = float(np.max(_first["before"]))
    reference = float(np.max(np.abs(_first["F before"])))
    images, moving, sections = {}, {}, []
    with house_style():
        _figure, _axes = panels(2, 3, 3.5, 2.8)
        _closed = "closed form" if spectrum_is_closed(built) else "of samples"
        for _k, _name in enumerate(("before", "after")):
            _ax = _axes[0, _k]
            _axis = map(shown.grid.axis, (0, 1))
            images[_name] = show_light_field(
                _ax, np.nan_to_num(_first[_name]), *_axis, signed=False, limit=top, names=_names
            )
            _ax.set_title(f"$L$ {_name}" + ("" if _k == 0 else f" the {built.name}"), loc="left")
            _mark = dict(marker="o", markersize=9, markerfacecolor="none", markeredgewidth=1.6)
            (moving[_name],) = _ax.plot([], [], linestyle="none", markeredgecolor="w", **_mark)
            _ax = _axes[1, _k]
            _pairs = shown.Omega, shown.Omega
            images[f"F {_name}"] = show_spectrum(
                _ax,
                _first[f"F {_name}"],
                *_pairs,
                decades=DECADES,
                reference=reference,
                names=_names,
            )
            _words = "closed form" if _k == 0 else _closed
            _ax.set_title(rf"$|\hat{{L}}|$ {_name}, {_words}", loc="left")
        for _k, _name in enumerate(_names):
            _ax, _half = _axes[_k, 2], shown.box[_k]
            _styles = (("-", 1.8, "$L$"), ("--", 1.2, "first order"), ("-.", 1.2, "second order"))
            _drawn = [
                _ax.plot([], [], linestyle=_dash, linewidth=_width, color=_colour, label=_word)[0]
                for (_dash, _width, _word), _colour in zip(_styles, COLOURS, strict=False)
            ]
            _dot = _ax.plot([], [], "o", color=COLOURS[0], markersize=5)[0]
            sections.append((*_drawn, _dot))
            _ax.set(xlim=(-_half, _half), ylim=(-0.15 * top, 1.35 * top))
            _ax.set_xlabel(label(_name))
            _ax.set_title(
                f"$L$ after, along {label(_name, unit=False)} through the ray", loc="left"
            )
            _ax.legend(loc="upper right", ncols=3, columnspacing=1.0, handlelength=1.6)
        _others = [artist for drawn in sections for artist in drawn]
        live = LiveFigure(_figure, [*images.values(), *moving.values(), *_others])
    return images, live, moving, reference, sections, top


@app.cell
def _(built, images, live, moving, reference, sections, shown, top):
    def png(numbers, ray):
        """The picture for these numbers and this ray, the seconds it took, and the jet there."""
        begin = time.perf_counter()
        now = portraits(shown, built.light, built.moved(numbers), jnp.asarray(ray))
        jet, now = now["jet"], jax.tree.map(np.asarray, now)
        for name, image in images.items():
            data = np.nan_to_num(now[name])
            image.set_data((log_magnitude(data, reference, DECADES) if name[0] == "F" else data).T)
        moving["after"].set_data([ray[0]], [ray[1]])
        moving["before"].set_data(*now["source"][:, None])
        for k, (line, first, second, dot) in enumerate(sections):
            s = np.asarray(shown.grid.axis(k))
            h = s - ray[k]
            slope = float(jet.value) + h * float(jet.gradient[k])
            bend = slope + 0.5 * h**2 * float(jet.hessian[k, k])
            line.set_data(s, now["along"][k])
            for drawn, values in ((first, slope), (second, bend)):
                near = (np.abs(h) < 0.6) & (values < 1.1 * top)
                drawn.set_data(s[near], values[near])
            dot.set_data([ray[k]], [float(jet.value)])
        return live.png(), time.perf_counter() - begin, jet

    return (png,)


if __name__ == "__main__":
    app.run()
