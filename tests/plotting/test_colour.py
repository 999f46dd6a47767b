"""Scenes of three bands are drawn in red, green and blue, and written a column for each."""

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import to_rgb

from firstorder import flatland
from firstorder.io import write_csv
from firstorder.plotting import draw_scene, receiver_curve, scene_report

SCENE = flatland.Scene.of(
    flatland.primitive(flatland.Segments((0.5, 1.0), (-0.5, 1.0)), emission=(1.2, 0.6, 0.3)),
    flatland.primitive(
        flatland.Segments((-1.0, 0.0), (1.0, 0.0)), name="floor", albedo=(0.9, 0.5, 0)
    ),
    environment=flatland.ConstantSky((0.0, 0.5, 1.0)),
)


def test_shapes_lamps_and_the_sky_have_their_colours():
    _, ax = plt.subplots()
    draw_scene(ax, SCENE)
    drawn = {to_rgb(line.get_color()) for line in ax.lines}
    assert {(0.9, 0.5, 0.0), (1.0, 0.5, 0.25)} <= drawn
    np.testing.assert_allclose(ax.collections[-1].get_colors()[0][:3], (0.0, 0.5, 1.0))
    plt.close()


def test_a_curve_has_a_line_and_a_column_for_each_band(tmp_path):
    curve = receiver_curve(SCENE, "floor", 5)
    assert curve["E"].shape == curve["d2E"].shape == (5, 3)
    each = [receiver_curve(SCENE.band(k), "floor", 5)["dE"] for k in range(3)]
    np.testing.assert_allclose(curve["dE"], np.stack(each, -1), rtol=1e-9, atol=1e-12)
    page = scene_report(SCENE, {"floor": curve})
    lines = [line for line in page.axes[1].lines if len(np.asarray(line.get_ydata())) == 5]
    np.testing.assert_array_equal([line.get_ydata() for line in lines], curve["E"].T)
    plt.close(page)
    write_csv(tmp_path / "a.csv", curve)
    head = (tmp_path / "a.csv").read_text().splitlines()[0].split(",")
    assert head[5:8] == ["E.R", "E.G", "E.B"]
    assert len(head) == 14
