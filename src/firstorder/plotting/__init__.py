"""Pictures of light in the style of this repository's figures.

Import it yourself: it brings matplotlib, and `import firstorder` does not. Importing it changes
no setting; `house_style()` is a context. Nothing here needs pyplot, so no window ever opens.
"""

from firstorder.plotting.caches import draw_expansions, draw_records, show_cache
from firstorder.plotting.film import develop, exposure_of, filmic, tinted, write_still
from firstorder.plotting.flatland import (
    curve_of,
    draw_curves,
    draw_scene,
    receiver_curve,
    scene_report,
)
from firstorder.plotting.light import log_magnitude, show_light_field, show_spectrum
from firstorder.plotting.live import LiveFigure, LiveImages
from firstorder.plotting.overlays import covariance_ellipse, print_scale, set_covariance
from firstorder.plotting.path_portraits import Portraits, portrait_strip, portraits
from firstorder.plotting.pictures import tone_map, write_png
from firstorder.plotting.scenes import draw_rays, draw_surface, map_axes
from firstorder.plotting.space import (
    draw_silhouettes,
    draw_sky,
    draw_view,
    project,
    silhouette_curves,
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
from firstorder.plotting.tables import draw_table

__all__ = [
    "COLOURS",
    "MAGNITUDE",
    "RADIANCE",
    "SIGNED",
    "house_style",
    "panels",
    "label",
    "share_labels",
    "show_light_field",
    "show_spectrum",
    "log_magnitude",
    "print_scale",
    "covariance_ellipse",
    "set_covariance",
    "Portraits",
    "portraits",
    "portrait_strip",
    "map_axes",
    "draw_surface",
    "draw_rays",
    "draw_scene",
    "receiver_curve",
    "curve_of",
    "draw_curves",
    "scene_report",
    "project",
    "silhouette_curves",
    "draw_view",
    "draw_silhouettes",
    "draw_sky",
    "draw_records",
    "draw_expansions",
    "show_cache",
    "draw_table",
    "tone_map",
    "write_png",
    "develop",
    "exposure_of",
    "filmic",
    "tinted",
    "write_still",
    "LiveFigure",
    "LiveImages",
]
