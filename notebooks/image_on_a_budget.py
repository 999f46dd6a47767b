import marimo

__generated_with = "0.25.2"
app = marimo.App(width="full", app_title="An image on a budget")

with app.setup:
    import time

    import marimo as mo
    import numpy as np

    from firstorder import imaging, reconstruction, rendering, session
    from firstorder.plotting import RADIANCE, LiveImages
    from firstorder.space import Scene, plane, primitive, rectangle, sphere

    session.start()
    METRICS = {
        "even": reconstruction.by_area,
        "differences of samples": reconstruction.by_differences,
        "gradient of the light": lambda cells: np.hypot(*cells.shaded.more.T) * cells.size**2,
        "gradient with shadows": reconstruction.by_gradient,
    }
    EVEN, BY_DIFFERENCES, BY_LIGHT, BY_ALL = METRICS
    START = (1200, BY_ALL, 1.5, 1.0)
    THINGS = (
        primitive(plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), name="floor", albedo=0.7),
        primitive(sphere((-0.75, 0.1, 0.9), 0.35), albedo=0.6),
        primitive(sphere((0.15, 0.45, 0.3), 0.3), albedo=0.5, specular=0.1, exponent=20.0),
        primitive(sphere((0.5, -0.55, 1.3), 0.16), albedo=0.8),
        primitive(rectangle((0.95, 0.1, 0.4), (0.25, 0.1, 0.1), (-0.1, 0.3, 0.0)), albedo=0.6),
    )
    SCENE = Scene.of(*THINGS)
    CAMERA = imaging.pinhole((0.1, -3.4, 2.6), (0.1, 0.0, 0.35), gamma=2.5)
    LIGHT = imaging.Lamp((-0.3, 0.2, 3.2), (0.0, 0.45, 0.0), (0.45, 0.0, 0.0), 12.0, 6)


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

    Next: [where the filter comes from](shadow_light_field.py), [a sphere and a box](sphere_and_box.py).
    """)
    return


@app.cell
def _():
    size = 96  # pixels along each side of the image
    return (size,)


@app.cell
def _(size):
    # Apart from the picture, which they need not wait for.
    _few, _steps, _start = (size // 8) ** 2, 50 if size > 32 else 4, START[0] * size**2 // 96**2
    _bands, _rays = [0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0], [0.25, 0.5, 1.0, 2.0, 4.0]
    sliders = [
        mo.ui.slider(_few, size**2 // 2, _steps, value=_start, label="samples"),
        mo.ui.dropdown(METRICS.keys(), value=START[1], label="metric"),
        mo.ui.slider(steps=_bands, value=START[2], label="band limit (cycles over the lamp)"),
        mo.ui.slider(steps=_rays, value=START[3], label="shared rays per pixel"),
    ]
    mo.hstack(sliders, justify="start", wrap=True)
    return (sliders,)


@app.cell
def _(png, sliders):
    _picture, _seconds = png(*(s.value for s in sliders))
    _picture = mo.image(_picture, alt="image, its error, its samples and the error expected")
    mo.vstack([_picture, mo.md(f"Redrawn in {_seconds:.1f} s.")])
    return


@app.function
def shared(hits, band, rays):
    """Light and shadows in the image; the pixels of the floor share shadow rays."""
    some = dict(rays_per_pixel=rays, band_limit=band, seed=2)
    return rendering.share_shadow_rays(SCENE, CAMERA, LIGHT, hits, "floor", **some)


@app.function
def painted(hits, sliders):
    """Samples, the image that they give, and the error that they lead to expect."""
    (budget, metric, *others), size = sliders, hits.index.shape
    shadows, some = shared(hits, *others), dict(labels=hits.index, batch=0.25, smallest=1.0)
    found = reconstruction.sample_image(shadows.shade, *size, budget, METRICS[metric], **some)
    return found.p, *shadows.image(found)


@app.cell
def _(size):
    # Once: every pixel with rays of its own, axes and scales.
    with mo.status.spinner(f"Shading {size**2} pixels with 256 shadow rays each, to compare ..."):
        hits = imaging.primary_hits(SCENE, CAMERA, size)
        truth = shared(hits, *START[2:]).reference(16, 1)
    _top = float(np.quantile(truth, 0.99))  # but for highlights
    _panels = {"image (W/(m$^2$ sr))": (RADIANCE, _top), "its error": (RADIANCE, 0.2 * _top)}
    _panels |= {"samples": ("gray", _top), "error expected": _panels["its error"]}
    live = LiveImages(_panels, size, size)

    def png(*sliders):
        """The picture for these sliders, and the seconds it took."""
        begin = time.perf_counter()
        p, image, expected = painted(hits, sliders)
        shown = image, np.abs(image - truth), 0.7 * truth, expected
        notes = {k: f"RMS {np.sqrt(np.mean(shown[k] ** 2)):.4f}" for k in (1, 3)}
        return live.png(shown, notes, {2: p}), time.perf_counter() - begin

    return hits, png, truth


if __name__ == "__main__":
    app.run()
