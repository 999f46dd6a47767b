"""Images and curves from few samples: where to sample, and how to interpolate between."""

from firstorder.reconstruction.bilateral import bilateral_widths, cross_bilateral
from firstorder.reconstruction.blue_noise import blue_noise_samples
from firstorder.reconstruction.delaunay import delaunay_image
from firstorder.reconstruction.directional import (
    DirectionalCoherence,
    coherent_image,
    directional_coherence,
)
from firstorder.reconstruction.grid import GridInterpolant
from firstorder.reconstruction.hermite import HermiteInterpolant, hermite_basis, interpolation_error
from firstorder.reconstruction.importance import (
    QuadtreeCells,
    ShadedSamples,
    by_area,
    by_density,
    by_differences,
    by_gradient,
    by_hessian,
    by_hessian_differences,
    by_tangent_planes,
    by_variance,
    importance_product,
    is_far_light,
)
from firstorder.reconstruction.line import (
    LineCell,
    LineSamples,
    line_by_curvature,
    line_by_differences,
    line_by_disagreement,
    line_by_gradient,
    line_by_length,
    sample_line,
)
from firstorder.reconstruction.quadtree import ImageSamples, sample_image
from firstorder.reconstruction.quadtree_mesh import quadtree_image

__all__ = [
    "LineCell",
    "LineSamples",
    "sample_line",
    "line_by_length",
    "line_by_differences",
    "line_by_gradient",
    "line_by_curvature",
    "line_by_disagreement",
    "ShadedSamples",
    "QuadtreeCells",
    "ImageSamples",
    "sample_image",
    "by_area",
    "by_gradient",
    "by_differences",
    "by_hessian",
    "by_hessian_differences",
    "by_tangent_planes",
    "by_variance",
    "by_density",
    "importance_product",
    "is_far_light",
    "blue_noise_samples",
    "HermiteInterpolant",
    "hermite_basis",
    "interpolation_error",
    "GridInterpolant",
    "delaunay_image",
    "quadtree_image",
    "bilateral_widths",
    "cross_bilateral",
    "DirectionalCoherence",
    "directional_coherence",
    "coherent_image",
]
