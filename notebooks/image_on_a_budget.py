import marimo

__generated_with = "0.25.2"
app = marimo.App(width="full", app_title="An image on a budget")

with app.setup:
    import time

    import marimo as mo
    import numpy as np

    from firstorder import imaging, reconstruction, session, shadowfield
    from firstorder.plotting import RADIANCE, LiveFigure, house_style, panels
    from firstorder.space import Scene, plane, primitive, rectangle, sphere

    session.start()
    OWN, TRUE = 4, 16  # shadow rays of a sample's own, along each side of the lamp; of the truth
    EVEN, BY_DIFFERENCES, BY_LIGHT, BY_ALL = METRICS = (
        "even",
        "differences of samples",
        "gradient of the light",
        "gradient with shadows",
    )
    START = (1200, BY_ALL, 1.5, 1.0)
    # What is seen. The floor alone shares shadow rays.
    THINGS = (
        primitive(plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), name="floor", albedo=0.7),
        primitive(sphere((-0.75, 0.1, 0.9), 0.35), albedo=0.6),
        primitive(sphere((0.15, 0.45, 0.3), 0.3), albedo=0.5, specular=0.1, exponent=20.0),
        primitive(sphere((0.5, -0.55, 1.3), 0.16), albedo=0.8),
        primitive(rectangle((0.95, 0.1, 0.4), (0.25, 0.1, 0.1), (-0.1, 0.3, 0.0)), albedo=0.6),
    )
    SCENE, GROUND = Scene.of(*THINGS), Scene.of(THINGS[0])
    (FLOOR,) = SCENE.named("floor")
    CAMERA = imaging.pinhole((0.1, -3.4, 2.6), (0.1, 0.0, 0.35), gamma=2.5)
    LIGHT = imaging.Lamp((-0.3, 0.2, 3.2), (0.0, 0.45, 0.0), (0.45, 0.0, 0.0), 12.0, 6)
    LAMP = shadowfield.lamp_frame(LIGHT.center, LIGHT.u, LIGHT.v)


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
def look(p, size):
    """What places of the image show, in pixels, and their light if nothing is hidden."""
    hits = imaging.primary_hits(SCENE, CAMERA, p=2.0 * p / size - 1.0)
    return hits, imaging.shade_pixels(SCENE, CAMERA, [LIGHT], hits.p, hits.index, shadows=False)


@app.function
def own_share(hits, strata, seed):
    """Share of the lamp that is seen, by rays of each place's own."""
    seen, met = np.zeros(len(hits.index)), hits.index >= 0
    some = hits.position[met], hits.index[met]
    seen[met] = shadowfield.own_visibility(SCENE, LAMP, *some, strata, seed)
    return seen


@app.cell
def _(size):
    # Once: every pixel with rays of its own, and what shared rays will be asked.
    _x = np.arange(size) + 0.5
    _hits, _light = look(np.stack(np.meshgrid(_x, _x, indexing="ij"), -1).reshape(-1, 2), size)
    labels = _hits.index.reshape(size, size)
    truth = (_light.value * own_share(_hits, TRUE, 1)).reshape(size, size)
    floor_points = _hits.position[_hits.index == FLOOR]
    return floor_points, labels, truth


@app.function
def painted(labels, floor_points, sliders):
    """Samples, the image that they give, and the error that they lead to expect."""
    (budget, metric, band, rays), size = sliders, len(labels)
    blockers = shadowfield.scene_blockers(SCENE, FLOOR)
    table, _ = shadowfield.trace_shadow_rays(LAMP, floor_points, rays, blockers, 3)
    Omega, pixel = band / (2.0 * LAMP.half[0]), 2.0 * 4.1 / (2.5 * size)  # of the floor [m]

    def shade(p):
        hits, light = look(p, size)
        seen, moved, floor = own_share(hits, OWN, 2), np.zeros((len(p), 2)), hits.index == FLOOR
        if np.any(floor):  # shared rays, and by their differences how shadows move
            step = 0.5 * np.array([(0, 0), (-1, 0), (1, 0), (0, -1), (0, 1)])
            beside = (p[floor] + step[:, None]).reshape(-1, 2)
            at = imaging.primary_hits(GROUND, CAMERA, p=2.0 * beside / size - 1.0).position
            own = np.tile(seen[floor], 5)
            found = shadowfield.sheared_shadow(LAMP, table, at, Omega, pixel, own).visible
            seen[floor], left, right, low, high = found.reshape(5, -1)
            moved[floor] = np.stack([right - left, high - low], -1)
        still = seen[:, None] * light.gradient * 2.0 / size
        full = still + light.value[:, None] * moved
        return reconstruction.ShadedSamples(seen * light.value, full, still)

    by_gradient = reconstruction.by_gradient
    by = {
        EVEN: reconstruction.by_area,
        BY_DIFFERENCES: reconstruction.by_differences,
        BY_LIGHT: lambda s: by_gradient(
            s._replace(shaded=s.shaded._replace(gradient=s.shaded.more))
        ),
        BY_ALL: by_gradient,
    }[metric]
    found = reconstruction.sample_image(
        shade, size, size, budget, by, labels=labels, batch=0.25, smallest=1.0
    )
    hits, light = look(found.p, size)

    def spread(values, **options):
        return reconstruction.delaunay_image(
            found.p, values, size, size, label=hits.index, labels=labels, **options
        )

    image = spread(found.value)
    curved = spread(found.value, scheme="gradient", gradient=found.gradient)
    own, floor = own_share(hits, OWN, 2), hits.index == FLOOR
    wrong = light.value * np.sqrt(own * (1.0 - own)) / OWN
    column, row = np.minimum(found.p[floor].astype(int), size - 1).T
    wrong[floor] = light.value[floor] * shadowfield.band_limit_sweep(
        LAMP, table, hits.position[floor], np.array([Omega, 2.0 * Omega]), pixel, own[floor],
        (column * size + row, size), own_rays=OWN**2,
    ).error[0]  # fmt: skip
    return {"p": found.p, "image": image, "expected": np.hypot(image - curved, spread(wrong))}


@app.cell
def _(floor_points, labels, size, truth):
    # Drawn once: axes, labels, scales.
    _top = float(np.quantile(truth, 0.99))  # but for highlights
    moving = {}
    with house_style():
        figure, _axes = panels(2, 2, 3.9, 3.4)
        for _ax, (_name, _title, _high) in zip(_axes.flat, (
            ("image", "image (W/(m$^2$ sr))", _top), ("error", "its error", 0.2 * _top),
            ("below", "samples", _top), ("expected", "error expected", 0.2 * _top),
        ), strict=True):  # fmt: skip
            _map = "gray" if _name == "below" else RADIANCE
            moving[_name] = _ax.imshow(
                truth.T, cmap=_map, vmin=0.0, vmax=_high, origin="lower", extent=(0, size, 0, size)
            )
            _ax.set(title=_title, xticks=[], yticks=[])
            _ax.grid(False)
            if _name == "below":
                (moving["dots"],) = _ax.plot([], [], ".", color="#38bdf8", markersize=1.6)
                continue
            figure.colorbar(moving[_name], ax=_ax, shrink=0.8)
            if _name != "image":
                moving[f"{_name}_rms"] = _ax.text(
                    0.02, 0.97, "", color="w", va="top", transform=_ax.transAxes
                )
        live = LiveFigure(figure, list(moving.values()))

    def png(*sliders):
        """The picture for these sliders, and the seconds it took."""
        begin = time.perf_counter()
        now = painted(labels, floor_points, sliders)
        now |= {"error": np.abs(now["image"] - truth), "below": 0.7 * truth}
        for name in ("image", "error", "below", "expected"):
            moving[name].set_data(now[name].T)
        for name in ("error", "expected"):
            moving[f"{name}_rms"].set_text(f"RMS {np.sqrt(np.mean(now[name] ** 2)):.4f}")
        moving["dots"].set_data(*now["p"].T)
        return live.png(), time.perf_counter() - begin

    return (png,)


if __name__ == "__main__":
    app.run()
