"""Pictures of light: what the figures of this repository are drawn with.

Import it yourself: it brings matplotlib, and `import firstorder` does not. Importing it changes
no setting; `house_style()` is a context. Nothing here needs pyplot, so no window ever opens.
"""

from firstorder.plotting.caches import draw_expansions, draw_records
from firstorder.plotting.flatland import (
    curve_of,
    draw_curves,
    draw_scene,
    receiver_curve,
    scene_report,
    shape_points,
)
from firstorder.plotting.light import log_magnitude, show_light_field, show_spectrum
from firstorder.plotting.live import Live
from firstorder.plotting.overlays import covariance_ellipse, mark, print_scale, set_covariance
from firstorder.plotting.portraits import Portraits, portrait_strip, portraits
from firstorder.plotting.scenes import draw_blocker, draw_rays, draw_surface, scene
from firstorder.plotting.space import (
    draw_silhouettes,
    draw_sky,
    draw_view,
    outline_curves,
    projected,
    sky_curves,
)
from firstorder.plotting.style import (
    COLOURS,
    MAGNITUDE,
    RADIANCE,
    SIGNED,
    house_style,
    label,
    panels,
    share_labels,
)
from firstorder.plotting.tables import table

__all__ = [
    "COLOURS",
    "MAGNITUDE",
    "RADIANCE",
    "SIGNED",
    "house_style",
    "label",
    "panels",
    "share_labels",
    "show_light_field",
    "show_spectrum",
    "log_magnitude",
    "print_scale",
    "covariance_ellipse",
    "set_covariance",
    "mark",
    "Portraits",
    "portraits",
    "portrait_strip",
    "scene",
    "draw_surface",
    "draw_blocker",
    "draw_rays",
    "draw_records",
    "draw_expansions",
    "draw_scene",
    "shape_points",
    "receiver_curve",
    "curve_of",
    "draw_curves",
    "scene_report",
    "projected",
    "outline_curves",
    "draw_view",
    "draw_silhouettes",
    "sky_curves",
    "draw_sky",
    "table",
    "Live",
]
