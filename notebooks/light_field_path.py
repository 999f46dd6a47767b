import marimo

__generated_with = "0.25.2"
app = marimo.App(width="full", app_title="A light field taken through a path")

with app.setup:
    import time
    from dataclasses import dataclass

    import equinox as eqx
    import jax
    import jax.numpy as jnp
    import marimo as mo
    import numpy as np

    from firstorder import session
    from firstorder.conventions import FLATLAND_SLOPE
    from firstorder.fields import GaussianProfile, Grid, gaussian
    from firstorder.plotting import (
        LiveFigure,
        covariance_ellipse,
        house_style,
        log_magnitude,
        panels,
        set_covariance,
        share_labels,
        show_light_field,
        show_spectrum,
    )
    from firstorder.transport import (
        Curvature,
        Mirror,
        Reflection,
        ToAngle,
        Travel,
        half_plane_blocker,
    )

    session.start(x64=False)  # a picture needs no more digits
    DECADES = 4.0


@app.cell
def _():
    mo.md(r"""
    # A light field taken through a path

    Light leaves a source, travels, passes the edge of a half-plane, travels on, and meets a curved
    glossy surface. Each column is one step; each row is one *portrait* of the same light: the
    radiance $L$, its derivatives along position and direction, and its spectrum, with the ellipse
    of the spectrum's covariance.

    Things to try:

    - Move the **distance**: radiance shears along $x$, the spectrum along $\Omega_v$, the other way.
    - Bend the **receiver**: now radiance shears along $\theta$, and the spectrum along $\Omega_x$.
      A curved mirror turns what light does in angle into detail in space.
    - Make it **rougher**: the blur acts on angle alone, so it cuts the spectrum above a band of
      $\Omega_\theta$, and at some curvature that takes the detail in space with it.
    - Move the **edge**: a shadow has energy at all frequencies, so from there on the covariance is
      infinite and the ellipse is gone.

    Next: [a shadow and its light field](shadow_light_field.py), [an event of your
    own](bring_your_own_event.py), [a scene under the mouse](explorer.py).
    """)
    return


@app.cell
def _():
    # Samples of radiance and derivatives along each axis.
    size = 64
    return (size,)


@app.cell
def _():
    distance = mo.ui.slider(0.1, 2.5, 0.05, value=1.0, label="distance to the edge (m)")
    edge = mo.ui.slider(-1.0, 1.0, 0.02, value=0.2, label="position of the edge (m)")
    kappa = mo.ui.slider(-1.5, 1.5, 0.05, value=0.4, label="curvature (rad/m)")
    roughness = mo.ui.slider(0.05, 0.3, 0.01, value=0.2, label="roughness (rad)")
    return distance, edge, kappa, roughness


@app.cell
def _(distance, edge, kappa, roughness):
    # Apart from the picture, which they need not wait for.
    sliders = [distance, edge, kappa, roughness]
    mo.hstack(sliders, justify="start", wrap=True)
    return (sliders,)


@app.cell
def _(png, shown, sliders):
    _picture, _seconds = png(*(s.value for s in sliders))
    _picture = mo.image(_picture, alt="portraits of the light at every step")
    mo.vstack(
        [
            _picture,
            mo.md(f"Redrawn in {1000 * _seconds:.0f} ms; {shown.size} samples along each axis."),
        ]
    )
    return


@app.cell
def _(size):
    shown = Shown(size)
    return (shown,)


@app.class_definition
class Lobe(GaussianProfile):
    """A Gaussian lobe that ends where a picture no longer shows it: at 1e-5 of its height."""

    def half_width(self):
        return 5.0 * self.sigma


@app.function
def path(distance, edge, kappa, roughness, half_width=4.5, harmonics=103, nodes=16):
    """Angles stand for slopes to first order, so that every spectrum has a closed form.

    For a spectrum the edge is a square wave, of some harmonics, on a window that holds the light.
    """
    source = gaussian((0.1, -0.05), (0.5, 0.3), 0.3, frame=FLATLAND_SLOPE)
    window = Grid.spanning((harmonics, 8), (half_width, 4.0))
    blocked = source >> Travel(distance) >> half_plane_blocker(edge, FLATLAND_SLOPE, window=window)
    arrived = blocked >> Travel(0.7) >> ToAngle().linearised(jnp.zeros(2))
    shine = Mirror() >> Reflection(Lobe(roughness), nodes=nodes) >> Curvature(kappa, back=True)
    return arrived >> Curvature(kappa) >> shine


@app.class_definition
@dataclass(frozen=True)
class Shown:
    """Which steps of the path are shown, and on which samples."""

    size: int
    steps = (0, 1, 2, 3, 5, 8)
    titles = ("source", "travel", "half-plane", "travel 0.7 m", "curved frame", "reflected")
    names = (("x", "v"),) * 4 + (("x", "theta"),) * 2

    @property
    def grids(self):
        """What is reflected is smooth, and costs an integral for each sample."""
        sizes = (self.size,) * 5 + (self.size // 2,)
        return [Grid.spanning((n, n), (1.6, 1.2)) for n in sizes]

    @property
    def Omega(self):
        return np.linspace(-2.2, 2.2, self.size // 3 + 5)


@app.function
@eqx.filter_jit
def portraits(shown, sliders):
    """Every portrait of every step, as one compiled function of the sliders (an array)."""
    light = path(*sliders)
    found = {"value": [], "dx": [], "dtheta": [], "spectrum": []}
    for k, grid in zip(shown.steps, shown.grids, strict=True):
        jets = light.steps[k].jets(*jnp.moveaxis(jnp.asarray(grid.points()), -1, 0))
        F = light.spectra[k](*jnp.meshgrid(shown.Omega, shown.Omega, indexing="ij"))
        found["value"].append(jets.value)
        found["dx"].append(jets.gradient[..., 0])
        found["dtheta"].append(jets.gradient[..., 1])
        found["spectrum"].append(jnp.abs(F))
    return found | {"covariance": [light.covariances[k].matrix for k in (0, 1)]}


@app.cell
def _(shown):
    # Drawn once: axes, labels, scales (those of the first portraits, so that changes show).
    with mo.status.spinner("Compiling the light of every step, its derivatives and spectra ..."):
        _start = jax.tree.map(np.asarray, portraits(shown, jnp.array([1.0, 0.2, 0.4, 0.2])))
    _rows = ("value", "dx", "dtheta", "spectrum")
    images, ellipses = {row: [] for row in _rows}, []
    with house_style():
        _figure, _axes = panels(4, len(shown.steps), 1.9, 1.6)
        for _axs, _row in zip(_axes, _rows, strict=True):
            _top = max(np.max(np.abs(a)) for a in _start[_row])
            for _k, (_ax, _data) in enumerate(zip(_axs, _start[_row], strict=True)):
                _names = shown.names[_k]
                if _row == "spectrum":
                    _image = show_spectrum(
                        _ax,
                        _data,
                        shown.Omega,
                        shown.Omega,
                        decades=DECADES,
                        reference=_top,
                        names=_names,
                    )
                else:
                    _axis = map(shown.grids[_k].axis, (0, 1))
                    _image = show_light_field(
                        _ax, _data, *_axis, signed=_row != "value", limit=_top, names=_names
                    )
                images[_row].append(_image)
                _words = {"value": shown.titles[_k], "dx": "$\\partial_x L$", "spectrum": "$|F|$"}
                _symbol = "v" if _names[1] == "v" else "\\theta"
                _ax.set_title(_words.get(_row, f"$\\partial_{_symbol} L$"), loc="left")
        share_labels(_axes)
        for _ax, _matrix in zip(_axes[3, :2], _start["covariance"], strict=True):
            ellipses.append(covariance_ellipse(_ax, _matrix))
        _moving = [image for row in images.values() for image in row]
        live = LiveFigure(_figure, [*_moving, *ellipses])
    reference = max(np.max(F) for F in _start["spectrum"])
    return ellipses, images, live, reference


@app.cell
def _(ellipses, images, live, reference, shown):
    def png(*sliders):
        """The picture for these sliders, and the seconds it took."""
        begin = time.perf_counter()
        now = jax.tree.map(np.asarray, portraits(shown, jnp.array(sliders)))
        for row, pictures in images.items():
            for image, data in zip(pictures, now[row], strict=True):
                shade = log_magnitude(data, reference, DECADES) if row == "spectrum" else data
                image.set_data(shade.T)
        for ellipse, matrix in zip(ellipses, now["covariance"], strict=True):
            set_covariance(ellipse, matrix)
        return live.png(), time.perf_counter() - begin

    return (png,)


if __name__ == "__main__":
    app.run()
