import marimo

__generated_with = "0.25.2"
app = marimo.App(width="full", app_title="An image on a budget")

with app.setup:
    import time
    from dataclasses import dataclass, field

    import jax
    import jax.numpy as jnp
    import marimo as mo
    import numpy as np

    from firstorder import session
    from firstorder.imaging.area_lights import Lamp
    from firstorder.imaging.camera import pinhole
    from firstorder.imaging.pixels import shade_all
    from firstorder.plotting import RADIANCE, Live, house_style, panels
    from firstorder.reconstruction.delaunay import reconstruct
    from firstorder.reconstruction.importance import Shaded, by_area, by_differences, by_gradient
    from firstorder.reconstruction.quadtree import sample_image
    from firstorder.shadowfield.rendering.band_limit_choice import ladder
    from firstorder.shadowfield.rendering.ray_table import lamp_frame, trace
    from firstorder.shadowfield.rendering.sheared_filter import sheared
    from firstorder.space import Scene, nearest, plane, rectangle, sphere, thing

    session.start()
    BLOCK = 1024  # rays at once
    HIGH, HALF = 3.2, 0.45  # of the lamp: above the floor, and of its edge [m]
    OWN = 4  # shadow rays of each sample's own, along each side of the lamp
    TRUE = 16  # the same for the reference
    EVEN, BY_DIFFERENCES, BY_LIGHT, BY_ALL = METRICS = (
        "even",
        "differences of samples",
        "gradient of the light",
        "gradient with shadows",
    )
    START = (1200, BY_ALL, 1.5, 1.0)


@app.cell
def _():
    mo.md(r"""
    # An image on a budget

    Balls and a card under a square lamp. Few of the pixels are shaded, the rest is interpolated; and
    few shadow rays are traced, which all pixels of the floor share through a sheared filter. Below: the
    image; how far it is from one with every pixel and 256 shadow rays each; where the samples went; and
    how large the error was *expected* to be, from what the samples themselves know.

    Things to try:

    - Move the **budget**: the error falls, and expected and measured errors fall together.
    - Change the **metric** at the same budget: *even* wastes samples on the bare floor, *gradient of
      the light* does not know that shadows move, *gradient with shadows* does.
    - Raise the **band limit**: the penumbra below the card sharpens, and noise appears. Lower it: both
      blur. The best one depends on the number of **shared rays**.
    """)
    return


@app.cell
def _():
    # Pixels along each side of the image.
    size = 96
    return (size,)


@app.cell
def _(size):
    budget = mo.ui.slider(
        (size // 8) ** 2, size**2 // 2, 50 if size > 32 else 4, value=START[0] * size**2 // 96**2,
        label="samples",
    )  # fmt: skip
    metric = mo.ui.dropdown(METRICS, value=START[1], label="metric")
    band = mo.ui.slider(
        steps=[0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0],
        value=START[2],
        label="band limit (cycles over the lamp)",
    )
    rays = mo.ui.slider(
        steps=[0.25, 0.5, 1.0, 2.0, 4.0], value=START[3], label="shared rays per pixel"
    )
    return band, budget, metric, rays


@app.cell
def _(band, budget, metric, png, rays, size):
    _sliders = [budget, metric, band, rays]
    _picture, _seconds = png(*(s.value for s in _sliders))
    mo.vstack(
        [
            mo.hstack(_sliders, justify="start", wrap=True),
            mo.image(_picture, alt="image, its error, its samples and the error expected"),
            mo.md(f"Redrawn in {_seconds:.1f} s; {size} x {size} pixels."),
        ]
    )
    return


@app.function
def things():
    """What is seen. The floor alone shares shadow rays."""
    return (
        thing(plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), name="floor", albedo=0.7),
        thing(sphere((-0.75, 0.1, 0.9), 0.35), albedo=0.6),
        thing(sphere((0.15, 0.45, 0.3), 0.3), albedo=0.5, specular=0.1, exponent=20.0),
        thing(sphere((0.5, -0.55, 1.3), 0.16), albedo=0.8),
        thing(rectangle((0.95, 0.1, 0.4), (0.25, 0.1, 0.1), (-0.1, 0.3, 0.0)), albedo=0.6),
    )


@app.function
def by_blocks(function, *rows):
    """Rows of arrays through a compiled function, of one size whatever their number."""
    count = len(rows[0])
    padded = np.resize(np.arange(count), -(-count // BLOCK) * BLOCK).reshape(-1, BLOCK)
    parts = [function(*(jnp.asarray(a[k]) for a in rows)) for k in padded]
    return [
        np.concatenate([np.asarray(a) for a in same])[:count] for same in zip(*parts, strict=True)
    ]


@app.function
@jax.jit
def first_hits(scene, origins, along, on):
    found = nearest(scene, origins, along, on)
    return found.t, found.index


@app.class_definition
@dataclass(frozen=True)
class View:
    """The scene and its camera, in pixels."""

    size: int
    scene: Scene = field(default_factory=lambda: Scene.of(*things()))

    @property
    def camera(self):
        return pinhole((0.1, -3.4, 2.6), (0.1, 0.0, 0.35), gamma=2.5)

    @property
    def light(self):
        """For shading: nodes of a lamp that nothing hides."""
        return Lamp((-0.3, 0.2, HIGH), (0.0, HALF, 0.0), (HALF, 0.0, 0.0), 12.0, 6)

    @property
    def lamp(self):
        """For shadow rays."""
        light = self.light
        return lamp_frame(light.center, light.u, light.v)

    @property
    def floor(self):
        """Number of the floor: shapes are numbered kind by kind."""
        return self.scene.named("floor")[0]

    @property
    def pixel(self):
        """Side of a pixel on the floor, in the middle of the image [m]."""
        return 2.0 * 4.1 / (2.5 * self.size)

    @property
    def grid(self):
        """Centres of all pixels."""
        x = np.arange(self.size) + 0.5
        return np.stack(np.meshgrid(x, x, indexing="ij"), -1).reshape(-1, 2)

    def hits(self, origins, along, on):
        """Distance and shape of what rays meet first."""
        on = np.broadcast_to(on, len(origins))
        return by_blocks(lambda *rays: first_hits(self.scene, *rays), origins, along, on)

    def look(self, p):
        """What pixels show: shapes, unhidden light as `Pixels`, and the points themselves."""
        q = 2.0 * p / self.size - 1.0
        along = np.asarray(jax.vmap(self.camera.direction)(jnp.asarray(q)))
        eye = np.broadcast_to(np.asarray(self.camera.eye), along.shape)
        t, index = self.hits(eye, along, -1)
        found = shade_all(self.scene, self.camera, [self.light], q, index, shadows=False)
        return index, found, eye + np.where(index >= 0, t, 0.0)[:, None] * along

    def on_floor(self, p):
        """Points of the floor at places of the image, whatever stands before it."""
        q = 2.0 * p / self.size - 1.0
        along = np.asarray(jax.vmap(self.camera.direction)(jnp.asarray(q)))
        eye = np.asarray(self.camera.eye)
        return eye - eye[2] / along[:, 2:] * along

    def blockers(self, a, b):
        """Shares of the way from the lamp b at which something first and last hides the floor a."""
        way = b - a
        far = np.linalg.norm(way, axis=1)
        along = way / far[:, None]
        last, _ = self.hits(a, along, self.floor)
        first, _ = self.hits(b, -along, -1)
        hidden = last < far
        return np.where(hidden, first / far, np.inf), np.where(hidden, 1 - last / far, -np.inf)

    def own_share(self, points, index, count, seed):
        """Share of the lamp that is seen, by stratified rays of each point's own."""
        rng = np.random.default_rng(seed)
        cell = np.stack(np.meshgrid(np.arange(count), np.arange(count), indexing="ij"), -1)
        place = (cell.reshape(-1, 2) + rng.random((len(points), count**2, 2))) * 2.0 / count - 1.0
        ends = np.append(place * HALF, np.zeros((*place.shape[:2], 1)), -1).reshape(-1, 3)
        start = np.repeat(points, count**2, 0)
        way = self.lamp.world(ends) - start
        far = np.linalg.norm(way, axis=1)
        t, _ = self.hits(start, way / far[:, None], np.repeat(index, count**2))
        return np.mean((t >= far).reshape(-1, count**2), 1)


@app.cell
def _(size):
    # Once: every pixel with rays of its own, and what shared rays will be asked.
    view = View(size)
    labels, _light, _points = view.look(view.grid)
    _met = np.flatnonzero(labels >= 0)
    truth = _light.value.copy()
    truth[_met] *= view.own_share(_points[_met], labels[_met], TRUE, 1)
    truth, labels = truth.reshape(size, size), labels.reshape(size, size)
    floor_points = _points[labels.ravel() == view.floor]
    return floor_points, labels, truth, view


@app.function
def shadows(view, table, Omega, p, index, points):
    """Share of the lamp that each sample sees, and its gradient per pixel on the floor."""
    visible, slope = np.zeros(len(p)), np.zeros((len(p), 2))
    met, floor = index >= 0, index == view.floor
    visible[met] = view.own_share(points[met], index[met], OWN, 2)
    if np.any(floor):
        step = 0.5 * np.eye(2)
        places = [points[floor], *(view.on_floor(p[floor] + s * h) for h in step for s in (-1, 1))]
        own = np.tile(visible[floor], 5)
        found = sheared(view.lamp, table, np.concatenate(places), Omega, view.pixel, own)
        middle, left, right, low, high = found.visible.reshape(5, -1)
        visible[floor] = middle
        slope[floor] = np.stack([right - left, high - low], -1)
    return visible, slope


@app.function
def painted(view, labels, floor_points, sliders):
    """Samples, the image that they give, and the error that they lead to expect."""
    budget, metric, band, rays = sliders
    table, _ = trace(view.lamp, floor_points, rays, view.blockers, 3)
    Omega = band / (2.0 * HALF)

    def shade(p):
        index, light, points = view.look(p)
        seen, moved = shadows(view, table, Omega, p, index, points)
        still = seen[:, None] * light.gradient * 2.0 / view.size
        full = still + light.value[:, None] * moved
        return Shaded(seen * light.value, full, still)

    by = {
        EVEN: by_area,
        BY_DIFFERENCES: by_differences,
        BY_LIGHT: lambda s: by_gradient(s._replace(shaded=Shaded(s.shaded.value, s.shaded.more))),
        BY_ALL: by_gradient,
    }[metric]
    found = sample_image(
        shade, view.size, view.size, budget, by, labels=labels, batch=0.25, smallest=1.0
    )
    index, light, points = view.look(found.p)
    side = view.size

    def spread(values, scheme="linear", gradient=None):
        return reconstruct(found.p, values, side, side, label=index, labels=labels,
                           scheme=scheme, gradient=gradient)  # fmt: skip

    image = spread(found.value)
    curved = spread(found.value, "gradient", found.gradient)
    wrong = np.zeros(len(index))
    floor = np.flatnonzero(index == view.floor)
    column, row = np.minimum(found.p[floor].astype(int), side - 1).T
    own = view.own_share(points[floor], index[floor], OWN, 2)
    rungs = ladder(view.lamp, table, points[floor], (Omega, 2.0 * Omega), view.pixel, own,
                   (column * side + row, side), own_rays=OWN**2)  # fmt: skip
    wrong[floor] = light.value[floor] * rungs.error[0]
    others = np.flatnonzero((index >= 0) & (index != view.floor))
    toss = view.own_share(points[others], index[others], OWN, 2)
    wrong[others] = light.value[others] * np.sqrt(toss * (1.0 - toss)) / OWN
    return {"p": found.p, "image": image, "expected": np.hypot(image - curved, spread(wrong))}


@app.cell
def _(floor_points, labels, size, truth, view):
    # Drawn once: axes, labels, scales.
    _top = float(np.quantile(truth, 0.99))  # but for highlights
    _options = dict(origin="lower", extent=(0, size, 0, size), aspect="equal")
    moving = {}
    with house_style():
        figure, _axes = panels(2, 2, 3.9, 3.4)
        for _ax, _name, _title, _high in (
            (_axes[0, 0], "image", "image (W/(m$^2$ sr))", _top),
            (_axes[0, 1], "error", "its error", 0.2 * _top),
            (_axes[1, 0], "below", "samples", _top),
            (_axes[1, 1], "expected", "error expected", 0.2 * _top),
        ):
            _map = "gray" if _name == "below" else RADIANCE
            moving[_name] = _ax.imshow(truth.T, cmap=_map, vmin=0.0, vmax=_high, **_options)
            _ax.set(title=_title, xticks=[], yticks=[])
            _ax.grid(False)
            if _name != "below":
                figure.colorbar(moving[_name], ax=_ax, shrink=0.8)
            if _name in ("error", "expected"):
                moving[f"{_name}_rms"] = _ax.text(
                    0.02, 0.97, "", color="w", va="top", transform=_ax.transAxes
                )
        (moving["dots"],) = _axes[1, 0].plot([], [], ".", color="#38bdf8", markersize=1.6)
        live = Live(figure, list(moving.values()))

    def png(*sliders):
        """The picture for these sliders, and the seconds it took."""
        begin = time.perf_counter()
        now = painted(view, labels, floor_points, sliders)
        error = np.abs(now["image"] - truth)
        for name, values in (("image", now["image"]), ("error", error), ("below", 0.7 * truth),
                             ("expected", now["expected"])):  # fmt: skip
            moving[name].set_data(values.T)
        for name, values in (("error", error), ("expected", now["expected"])):
            moving[f"{name}_rms"].set_text(f"RMS {np.sqrt(np.mean(values**2)):.4f}")
        moving["dots"].set_data(*now["p"].T)
        return live.png(), time.perf_counter() - begin

    return (png,)


if __name__ == "__main__":
    app.run()
