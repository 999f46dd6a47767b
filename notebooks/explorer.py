import marimo

__generated_with = "0.25.2"
app = marimo.App(width="full", app_title="Explorer")

with app.setup:
    import marimo as mo
    from flatland_explorer.widget import Explorer

    from firstorder import session

    _ = session.start()


@app.cell
def _():
    mo.md(r"""
    # Explorer

    A scene of flatland under the mouse. **Drag** anything: a line moves as a whole, its dots are its
    ends, the dot on its stem turns its normal, and the one in the middle of the mirror bends it. The
    red line receives; the red dot on it looks around, and its stem tilts its normal.
    """)
    return


@app.cell
def _():
    # Places along the receiver.
    size = 192
    return (size,)


@app.cell
def _(size):
    # On a page the pictures come one by one, each as soon as its program is compiled.
    on_page = mo.app_meta().request is not None
    explorer = Explorer(count=size) if on_page else Explorer(count=size).draw()
    page = mo.ui.anywidget(explorer)
    page
    return explorer, page


@app.cell
def _():
    mo.md(r"""
    - **Scene**: what the probe sees. Yellow reaches a lamp, grey a shape, and lines are the edges
      between. The dashed line is the ray, by way of the mirror if there is one, of the path below.
    - **E, E′, E″** along the receiver, exact. Dotted lines are jumps: there two edges are in line.
      Violet are the records of a cache with their reach, and what it answers between them (the slider
      sets its error). Blue is the light by way of the mirror, from rays; the red curve is without it.
      Grey is within a body, where there is no value.
    - **Light field**: radiance over place and direction. Edges of shapes are exact curves.
    - **Spectrum** of the shadow of the first lamp, with the wedge between the depths of what stands
      among its rays.
    - **Path**: light of the lamp, as a Gaussian, to first order about the dashed ray: the ellipse of
      $L$ and that of its spectrum after each event.

    Next: [a shadow and its light field](shadow_light_field.py), [a light field taken through a
    path](light_field_path.py), [an event of your own](bring_your_own_event.py).
    """)
    return


if __name__ == "__main__":
    app.run()
