import marimo

__generated_with = "0.25.2"
app = marimo.App(width="full", app_title="A shadow, its derivatives and its light field")

with app.setup:
    import time
    from dataclasses import dataclass

    import equinox as eqx
    import jax
    import jax.numpy as jnp
    import marimo as mo
    import numpy as np

    from firstorder import session
    from firstorder.checks.agreements import QUICK, agreements
    from firstorder.fields import Grid
    from firstorder.flatland import (
        Circles,
        Receiver,
        Scene,
        Segments,
        derivatives,
        irradiance,
        primitive,
    )
    from firstorder.plotting import (
        LiveFigure,
        draw_surface,
        house_style,
        label,
        log_magnitude,
        map_axes,
        panels,
        show_light_field,
        show_spectrum,
    )
    from firstorder.shadowfield import (
        Wedge,
        energy_outside,
        grid_visibility,
        power_spectrum,
        sheared_filter,
    )

    session.start(x64=False)  # a picture needs no more digits
    DECADES = 2.5
    STRIP, LEVEL = (0.62, 0.80), 0.55  # a strip that stays where it is: from, to, height


@app.cell
def _():
    mo.md(r"""
    # A shadow, its derivatives and its light field

    A light hangs 1 m above a floor; a disc and a strip stand between them. Below: the irradiance $E$
    along the floor with its exact derivatives $E'$ and $E''$; the *shadow light field* $f(x, y)$, which
    says of each ray from $y$ on the light's plane to $x$ on the floor whether it passes; and the
    spectrum of $f$, with the wedge between the depths of the two blockers and the sheared filter that
    a light of this size asks for (its band limit taken as one cycle per width).

    Things to try:

    - Move the **disc**: its band in $f$ moves, the spectrum hardly does.
    - Raise it: the nearer the light, the flatter its band, and the steeper its line of energy.
    - Make the **light** narrower: the kinks of $E$ sharpen, and the filter grows.
    - Let the disc's shadow meet the strip's: where bands cross, $E'$ jumps, and energy leaves the
      wedge.

    Next: [an image from few samples and few rays](image_on_a_budget.py), [a scene under the
    mouse](explorer.py).
    """)
    return


@app.cell
def _():
    # Receivers, and rays along each axis.
    size = 128
    return (size,)


@app.cell
def _():
    place = mo.ui.slider(0.05, 0.95, 0.01, value=0.35, label="disc along the floor (m)")
    height = mo.ui.slider(0.68, 0.88, 0.01, value=0.75, label="disc above the floor (m)")
    radius = mo.ui.slider(0.02, 0.1, 0.005, value=0.06, label="its radius (m)")
    lamp = mo.ui.slider(0.2, 0.8, 0.01, value=0.5, label="middle of the light (m)")
    width = mo.ui.slider(0.05, 0.6, 0.01, value=0.4, label="its width (m)")
    return height, lamp, place, radius, width


@app.cell
def _(height, lamp, place, radius, width):
    # Apart from the picture, which they need not wait for.
    sliders = [place, height, radius, lamp, width]
    mo.hstack(sliders, justify="start", wrap=True)
    return (sliders,)


@app.cell
def _(png, shown, sliders):
    _picture, _seconds = png(*(s.value for s in sliders))
    _picture = mo.image(_picture, alt="the scene, its irradiance, its light field and its spectrum")
    mo.vstack(
        [
            _picture,
            mo.md(f"Redrawn in {1000 * _seconds:.0f} ms; {shown.size} receivers, rays squared."),
        ]
    )
    return


@app.cell
def _(size):
    shown = Shown(size)
    return (shown,)


@app.class_definition
@dataclass(frozen=True)
class Shown:
    """The samples: x and y from 0 to 1."""

    size: int

    @property
    def grid(self):
        return Grid.spanning((self.size, self.size), (0.5, 0.5), (0.5, 0.5))

    @property
    def near(self):
        """Which frequencies are shown."""
        return slice(self.size // 2 - self.size // 4, self.size // 2 + self.size // 4 + 1)

    @property
    def Omega(self):
        return np.asarray(self.grid.frequencies(0))[self.near]


@app.function
def blocked(place, height, radius, lamp, width):
    """The scene, as the sliders have it."""
    ends = jnp.stack([lamp + 0.5 * width, lamp - 0.5 * width])
    light = Segments(jnp.stack([ends[0], 1.0]), jnp.stack([ends[1], 1.0]))
    disc = primitive(Circles(jnp.stack([place, height]), radius), name="blocker")
    strip = primitive(Segments((STRIP[0], LEVEL), (STRIP[1], LEVEL)), name="blocker")
    return Scene.of(disc, strip, primitive(light, name="light", emission=1.0))


@app.function
@eqx.filter_jit
def portraits(shown, sliders):
    """All that is drawn, as one compiled function of the sliders (an array)."""
    place, height, radius, lamp, width = sliders
    world, grid = blocked(*sliders), shown.grid
    x = jnp.asarray(grid.axis(0), sliders.dtype)
    points = jax.vmap(lambda x: Receiver(jnp.stack([x, 0.0]), 0.0))(x)
    E = jax.vmap(lambda at: derivatives(irradiance, world, at, freedoms=("x",)))(points)
    f = grid_visibility(world, grid)
    depths = 1.0 - height - radius, jnp.maximum(1.0 - LEVEL, 1.0 - height + radius)
    wedge = Wedge(*depths)
    energy = power_spectrum(f, grid)
    Omega = [jnp.asarray(grid.frequencies(i)) for i in range(2)]
    inside = wedge.contains(*jnp.meshgrid(*Omega, indexing="ij"), 1.0, 2.0)
    k = sheared_filter(1.0, *depths, 1.0 / width, 0.5 * shown.size)
    t = jnp.linspace(0.0, 2.0 * np.pi, 61)
    disc = jnp.stack([place + radius * jnp.cos(t), height + radius * jnp.sin(t)])
    return {
        "E": (E.value, E.first, E.second),
        "f": f,
        "F": jnp.sqrt(energy)[shown.near, shown.near],
        "slopes": wedge.slopes(1.0),
        "filter": jnp.concatenate([k.corners(), k.corners()[:1]]),
        "outside": energy_outside(energy, inside),
        "disc": disc,
        "light": jnp.stack([lamp - 0.5 * width, lamp + 0.5 * width]),
    }


@app.cell
def _(shown):
    # Drawn once: axes, labels, scales (those of the first portraits, so that changes show).
    with mo.status.spinner("Compiling the irradiance, its derivatives and the light field ..."):
        _first = portraits(shown, jnp.array([0.35, 0.75, 0.06, 0.5, 0.4]))
        _start = jax.tree.map(np.asarray, _first)
    x, Omega = np.asarray(shown.grid.axis(0)), shown.Omega
    reference = float(np.max(_start["F"]))
    moving = {}
    with house_style():
        _figure, _axes = panels(2, 3, 3.3, 2.5)
        _map = map_axes(_axes[0, 0], "scene")
        draw_surface(_map, [(0.0, 0.0), (1.0, 0.0)], depth=0.04)
        _map.plot(STRIP, (LEVEL, LEVEL), color="0.15", linestyle="-", linewidth=2.5)
        (moving["disc"],) = _map.plot([], [], color="0.15", linestyle="-", linewidth=2.0)
        (moving["lamp"],) = _map.plot([], [], color="#e0a526", linestyle="-", linewidth=4.0)
        _map.set_xlim(-0.03, 1.03)
        _map.set_ylim(-0.06, 1.05)
        for _k, (_ax, _words) in enumerate(
            zip((_axes[0, 1], _axes[0, 2], _axes[1, 0]), ("E", "E'", "E''"), strict=True)
        ):
            _most = 1.6 * float(np.max(np.abs(_start["E"][_k])))
            (moving[f"E{_k}"],) = _ax.plot([], [])
            _ax.set(xlim=(0.0, 1.0), ylim=(0.0 if _k == 0 else -_most, _most))
            _ax.set_xlabel(label("x"))
            _ax.set_title(f"${_words}$", loc="left")
        _ax = _axes[1, 1]
        moving["f"] = show_light_field(
            _ax, _start["f"], x, x, limit=1.0, names=("x", "y"), title="$f(x, y)$", scale=False
        )
        for _end in (0, 1):
            (moving[f"end{_end}"],) = _ax.plot([], [], color="#e0a526", linestyle="-")
        _ax = _axes[1, 2]
        moving["F"] = show_spectrum(
            _ax, _start["F"], Omega, Omega, decades=DECADES, names=("x", "y"), scale=False
        )
        _box = _ax.get_xlim(), _ax.get_ylim()
        for _edge in (0, 1):
            (moving[f"edge{_edge}"],) = _ax.plot([], [], color="white", linestyle="--")
        (moving["filter"],) = _ax.plot([], [], color="#e0a526", linestyle="-")
        moving["outside"] = _ax.text(0.03, 0.94, "", transform=_ax.transAxes, color="white")
        _ax.set(xlim=_box[0], ylim=_box[1])
        _ax.set_title("spectrum, wedge, filter", loc="left")
        live = LiveFigure(_figure, list(moving.values()))
    return Omega, live, moving, reference, x


@app.cell
def _(Omega, live, moving, reference, shown, x):
    def png(*sliders):
        """The picture for these sliders, and the seconds it took."""
        begin = time.perf_counter()
        now = jax.tree.map(np.asarray, portraits(shown, jnp.array(sliders)))
        moving["disc"].set_data(*now["disc"])
        moving["lamp"].set_data(now["light"], [1.0, 1.0])
        for k, values in enumerate(now["E"]):
            moving[f"E{k}"].set_data(x, values)
        moving["f"].set_data(now["f"].T)
        moving["F"].set_data(log_magnitude(now["F"], reference, DECADES).T)
        for k in (0, 1):
            moving[f"end{k}"].set_data([0.0, 1.0], [now["light"][k]] * 2)
            slope, reach = now["slopes"][k], np.array([Omega[0], Omega[-1]])
            moving[f"edge{k}"].set_data(reach / max(slope, 1.0), reach * min(slope, 1.0))
        moving["filter"].set_data(*now["filter"].T)
        moving["outside"].set_text(f"outside the wedge: {100 * float(now['outside']):.1f} %")
        return live.png(), time.perf_counter() - begin

    return (png,)


@app.cell
def _():
    # The first scene in independent ways, in double precision; see `agreements` for more of them.
    _wait = mo.status.spinner("Asking for the light in other ways ...")
    with _wait, jax.enable_x64(True):
        _table = agreements(
            blocked(0.35, 0.75, 0.06, 0.5, 0.4),
            Receiver((0.42, 0.0), 0.0),
            sizes=QUICK,
            name="disc and strip",
            ways=("visible", "rays, a"),
            spectrum=False,
        )
    mo.md(f"```\n{_table}\n```")
    return


if __name__ == "__main__":
    app.run()
