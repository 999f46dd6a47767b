import marimo

__generated_with = "0.25.2"
app = marimo.App(width="full", app_title="A sphere and a box over a plane")

with app.setup:
    import time
    from dataclasses import dataclass

    import equinox as eqx
    import jax
    import jax.numpy as jnp
    import marimo as mo
    import numpy as np

    from firstorder import session
    from firstorder.caching import elliptic_regions
    from firstorder.plotting import LiveFigure, house_style, panels, silhouette_curves
    from firstorder.space import Scene, box, in_receiver_frame, primitive, receiver, sphere
    from firstorder.space.direct_lighting import irradiance

    session.start(x64=False)  # a picture needs no more digits
    HALF, RADIUS, WIDTH = 1.5, 0.4, 0.3  # of the floor, the sphere and the box [m]
    RECORDS = 6  # along each side
    CURVES = 13  # a sphere's silhouette and a box's edges
    START = (-0.5, 0.7, 0.5, 0.8, 0.2, 0.2)


@app.cell
def _():
    mo.md(r"""
    # A sphere and a box over a plane

    Under a white sky, a sphere hangs over a floor beside an upright box. Below: the irradiance $E$ on
    the floor, grey under the box, where there is no value; its derivative along $x$, exact and soft
    shadows included, and the gradient as arrows; what a receiver (the cross) sees of the silhouettes,
    in the disc of directions above it; and cache records, whose ellipses say how far each may be
    extrapolated with its gradient.

    Things to try:

    - Lower the **sphere**: its penumbra sharpens below it, and the records there shrink.
    - Move the **box** into the sphere's shadow: silhouettes overlap in the receiver's sky.
    - Walk the **receiver** under the sphere: its silhouette closes around the zenith.
    - Allow more **error**: ellipses grow with its fourth root.

    Next: [an image from few samples and few rays](image_on_a_budget.py), [a scene of flatland under
    the mouse](explorer.py).
    """)
    return


@app.cell
def _():
    # Receivers along each side of the floor.
    size = 32
    return (size,)


@app.cell
def _():
    ball = mo.ui.slider(-1.2, 1.2, 0.02, value=START[0], label="sphere along x (m)")
    height = mo.ui.slider(0.45, 1.5, 0.01, value=START[1], label="sphere above the floor (m)")
    place = mo.ui.slider(-1.1, 1.1, 0.02, value=START[2], label="box along x (m)")
    top = mo.ui.slider(0.1, 1.5, 0.02, value=START[3], label="its height (m)")
    eye = mo.ui.slider(-1.4, 1.4, 0.02, value=START[4], label="receiver along x (m)")
    error = mo.ui.slider(0.02, 1.0, 0.02, value=START[5], label="error of a record (1/1000 W)")
    return ball, error, eye, height, place, top


@app.cell
def _(ball, error, eye, height, place, top):
    # Apart from the picture, which they need not wait for.
    sliders = [ball, height, place, top, eye, error]
    mo.hstack(sliders, justify="start", wrap=True)
    return (sliders,)


@app.cell
def _(png, shown, sliders):
    _picture, _seconds = png(*(s.value for s in sliders))
    _picture = mo.image(_picture, alt="irradiance, gradient, silhouettes and cache records")
    _said = f"Redrawn in {1000 * _seconds:.0f} ms; {shown.size} x {shown.size} receivers."
    mo.vstack([_picture, mo.md(_said)])
    return


@app.cell
def _(size):
    shown = Shown(size)
    return (shown,)


@app.class_definition
@dataclass(frozen=True)
class Shown:
    """The receivers: the middles of square cells of the floor."""

    size: int

    @property
    def x(self):
        return HALF * (2.0 * np.arange(self.size) + 1.0 - self.size) / self.size

    @property
    def records(self):
        """Rows and columns at which there are records."""
        return np.unique(np.round((np.arange(RECORDS) + 0.5) * self.size / RECORDS).astype(int))


@app.function
def blocked(ball, height, place, top):
    """The scene, as the sliders have it."""
    low = jnp.stack([place - 0.5 * WIDTH, -0.5 * WIDTH + 0.0 * place, 0.0 * place])
    high = jnp.stack([place + 0.5 * WIDTH, 0.5 * WIDTH + 0.0 * place, top])
    center = jnp.stack([ball, 0.0 * ball, height])
    return Scene.of(primitive(sphere(center, RADIUS)), primitive(box(low, high)), environment=1.0)


@app.function
@eqx.filter_jit
def portraits(shown, sliders):
    """Irradiance, its gradient and the records, as one compiled function of the sliders."""
    scene, x = blocked(*sliders[:4]), jnp.asarray(shown.x, sliders.dtype)

    def light(place):
        return irradiance(scene, receiver(jnp.append(place, 0.0)), nodes=8)

    places = jnp.stack(jnp.meshgrid(x, x, indexing="ij"), -1).reshape(-1, 2)
    E, dE = jax.lax.map(jax.value_and_grad(light), places, batch_size=64)
    E, dE = (a.reshape(shown.size, shown.size, *a.shape[1:]) for a in (E, dE))
    slope = jnp.where(jnp.isfinite(E), dE[..., 0], jnp.nan)  # no value under the box, as of E
    dE = jnp.where(jnp.isfinite(dE), dE, 0.0)
    # Exact gradients, so one difference is enough for a Hessian.
    step = 2.0 * HALF / shown.size
    H = jnp.stack(jnp.gradient(dE, step, axis=(0, 1)), -1)
    at = jnp.asarray(shown.records)
    H = H[at][:, at].reshape(-1, 2, 2)
    H = 0.5 * (H + jnp.swapaxes(H, 1, 2))
    reach = elliptic_regions(H, 1e-3 * sliders[5], 0.02, 0.6)
    t = jnp.linspace(0.0, 2.0 * jnp.pi, 49)
    around = jnp.linalg.solve(reach.matrix, jnp.stack([jnp.cos(t), jnp.sin(t)]))
    middle = jnp.stack(jnp.meshgrid(x[at], x[at], indexing="ij"), -1).reshape(-1, 2, 1)
    return {"E": E, "dE": dE, "slope": slope, "records": middle + around}


@app.function
def silhouettes(sliders):
    """Curves in the disc of directions above the receiver; as many as there can be, some empty."""
    scene = blocked(*jnp.asarray(sliders[:4], float))
    at = receiver(jnp.array([sliders[4], 0.0, 0.0]))
    out = [np.full((2, 2), np.nan)] * CURVES
    for k, (_, points) in enumerate(silhouette_curves(scene, at.position)[:CURVES]):
        if len(points) == 2:
            points = points[0] + np.linspace(0.0, 1.0, 33)[:, None] * (points[1] - points[0])
        w = np.asarray(in_receiver_frame(at, jnp.asarray(points) - at.position))
        w = w / np.maximum(np.linalg.norm(w, axis=-1, keepdims=True), 1e-9)
        out[k] = np.where(w[:, 2:] >= -1e-6, w[:, :2], np.nan)
    return out


@app.cell
def _(shown):
    # Drawn once: axes, labels, scales.
    from firstorder.plotting import RADIANCE, SIGNED

    with mo.status.spinner(
        f"Compiling the light of {shown.size**2} receivers, and its gradient ..."
    ):
        start = jax.tree.map(np.asarray, portraits(shown, jnp.array(START)))
    extent = (-HALF, HALF, -HALF, HALF)
    moving = {}
    with house_style():
        figure, _axes = panels(2, 2, 3.6, 3.1)
        for _ax, _name, _words in (
            (_axes[0, 0], "E", "$E$ (W/m$^2$)"),
            (_axes[0, 1], "slope", r"$\partial E/\partial x$ (W/m$^3$)"),
            (_axes[1, 1], "below", "records"),
        ):
            _signed = _name == "slope"
            _limits = (-3.0, 3.0) if _signed else (0.0, np.pi)
            moving[_name] = _ax.imshow(
                start["E"].T,
                origin="lower",
                extent=extent,
                cmap=SIGNED if _signed else RADIANCE,
                vmin=_limits[0],
                vmax=_limits[1],
                aspect="equal",
            )
            _ax.set_title(_words, loc="left")
            _ax.grid(False)
            if _name != "below":
                figure.colorbar(moving[_name], ax=_ax, shrink=0.8)
        _every = max(1, shown.size // 10)
        moving["arrows"] = _axes[0, 1].quiver(
            *np.meshgrid(shown.x[::_every], shown.x[::_every], indexing="ij"),
            *np.moveaxis(start["dE"][::_every, ::_every], -1, 0),
            scale=30.0,
            width=0.004,
        )
        (moving["eye"],) = _axes[0, 0].plot([], [], "x", color="#b91c1c")
        for _k in range(len(start["records"])):
            (moving[f"record{_k}"],) = _axes[1, 1].plot([], [], "-", color="w", linewidth=0.8)
        _axes[1, 1].set(xlim=(-HALF, HALF), ylim=(-HALF, HALF))
        _ax = _axes[1, 0]
        _turn = np.linspace(0.0, 2.0 * np.pi, 97)
        _ax.plot(np.cos(_turn), np.sin(_turn), "-", color="0.6", linewidth=0.8)
        for _k in range(CURVES):
            (moving[f"curve{_k}"],) = _ax.plot([], [], "-", color="0.15", linewidth=1.2)
        _ax.set(xlim=(-1.05, 1.05), ylim=(-1.05, 1.05), aspect="equal", xticks=[], yticks=[])
        _ax.grid(False)
        _ax.set_title("the receiver's sky", loc="left")
        live = LiveFigure(figure, list(moving.values()))
    every = _every
    return every, live, moving


@app.cell
def _(every, live, moving, shown):
    def png(*sliders):
        """The picture for these sliders, and the seconds it took."""
        begin = time.perf_counter()
        now = jax.tree.map(np.asarray, portraits(shown, jnp.array(sliders)))
        moving["E"].set_data(now["E"].T)
        moving["below"].set_data(now["E"].T)
        moving["slope"].set_data(now["slope"].T)
        moving["arrows"].set_UVC(*np.moveaxis(now["dE"][::every, ::every], -1, 0))
        moving["eye"].set_data([sliders[4]], [0.0])
        for k, ring in enumerate(now["records"]):
            moving[f"record{k}"].set_data(*ring)
        for k, curve in enumerate(silhouettes(sliders)):
            moving[f"curve{k}"].set_data(*curve.T)
        return live.png(), time.perf_counter() - begin

    return (png,)


if __name__ == "__main__":
    app.run()
