"""An image with soft shadows from few samples and few shadow rays, with its expected error."""

import numpy as np

from firstorder import imaging, reconstruction, rendering, session
from firstorder.space import Scene, plane, primitive, sphere

session.start()
size, budget = 64, 800  # of 4096 pixels
world = (
    primitive(plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), name="floor", albedo=0.7),
    primitive(sphere((-0.3, 0.1, 0.9), 0.35), albedo=0.6),
)
scene = Scene.of(*world)
camera = imaging.pinhole((0.1, -3.4, 2.6), (0.1, 0.0, 0.35), gamma=2.5)
lamp = imaging.Lamp((-0.3, 0.2, 3.2), (0.0, 0.45, 0.0), (0.45, 0.0, 0.0), radiance=12.0)

hits = imaging.primary_hits(scene, camera, size)
shadows = rendering.share_shadow_rays(
    scene, camera, lamp, hits, "floor", rays_per_pixel=2.0, band_limit=1.0
)
found = reconstruction.sample_image(
    shadows.shade, size, size, budget, labels=hits.index, batch=0.25, smallest=1.0
)
image = shadows.image(found)
truth = shadows.reference(strata=16, seed=9)  # every pixel, with 256 shadow rays of its own


def rms(values):
    """Root mean square, over the mean radiance of the image."""
    return np.sqrt(np.mean(values**2)) / np.mean(truth)


print("samples", len(found.p))
print("expected error", rms(image.error))
print("measured error", rms(image.value - truth))
