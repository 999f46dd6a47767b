"""What light is: a field, and the portraits that can be drawn of it."""

from firstorder.fields.apertures import Bars, Grating, SoftSlit
from firstorder.fields.covariance import Covariance, covariance_of, covariance_of_samples
from firstorder.fields.environment import Environment, Harmonics, NearLight
from firstorder.fields.field import Affine, Constant, Edge, Field, Function, Sum
from firstorder.fields.gaussians import Gaussian, gaussian
from firstorder.fields.jet import Jet, autodiff_jet
from firstorder.fields.kernel import GaussianProfile, Kernel, Profile
from firstorder.fields.mask import HalfPlane, SoftEdge, half_plane
from firstorder.fields.sampled import Sampled
from firstorder.fields.series import Series
from firstorder.fields.sources import (
    Box,
    Dirac,
    Flat,
    Separable,
    line_light,
    point_light,
    spot_light,
)
from firstorder.fields.spectrum import Grid, SampledSpectrum, Spectrum, discrete_transform
from firstorder.fields.wavelet import Wavelet, haar_matrix, triple_products
from firstorder.fields.windowed import windowed_covariance

__all__ = [
    "Affine",
    "Bars",
    "Box",
    "Constant",
    "Covariance",
    "Dirac",
    "Edge",
    "Environment",
    "Field",
    "Flat",
    "Function",
    "Gaussian",
    "GaussianProfile",
    "Grating",
    "Grid",
    "HalfPlane",
    "Harmonics",
    "Jet",
    "Kernel",
    "NearLight",
    "Profile",
    "Sampled",
    "SampledSpectrum",
    "Separable",
    "Series",
    "SoftEdge",
    "SoftSlit",
    "Spectrum",
    "Sum",
    "Wavelet",
    "autodiff_jet",
    "covariance_of",
    "covariance_of_samples",
    "discrete_transform",
    "gaussian",
    "haar_matrix",
    "half_plane",
    "line_light",
    "point_light",
    "spot_light",
    "triple_products",
    "windowed_covariance",
]
