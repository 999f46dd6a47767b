"""Light fields, and the portraits drawn of them: jet, spectrum, covariance, wavelets."""

from firstorder.fields.apertures import Bars, Grating, SoftSlit
from firstorder.fields.covariance import Covariance, covariance_of, covariance_of_samples
from firstorder.fields.environment import Environment, Harmonics, NearLight
from firstorder.fields.extent import Extent
from firstorder.fields.field import Affine, Constant, Edge, Field, Function, Sum
from firstorder.fields.gaussians import Gaussian, gaussian
from firstorder.fields.jet import Jet, autodiff_jet
from firstorder.fields.kernel import GaussianProfile, Kernel, Profile
from firstorder.fields.mask import HalfPlane, SoftEdge, half_plane
from firstorder.fields.sources import (
    BoxProfile,
    DiracProfile,
    Separable,
    UniformProfile,
    point_light,
    spot_light,
)
from firstorder.fields.spectrum import (
    Grid,
    SampledSpectrum,
    Spectrum,
    SumSpectrum,
    discrete_transform,
)
from firstorder.fields.spline import Spline
from firstorder.fields.wavelet import Wavelet

__all__ = [
    "Field",
    "Edge",
    "Constant",
    "Affine",
    "Function",
    "Sum",
    "Jet",
    "autodiff_jet",
    "Spectrum",
    "SampledSpectrum",
    "SumSpectrum",
    "discrete_transform",
    "Grid",
    "Covariance",
    "Extent",
    "covariance_of",
    "covariance_of_samples",
    "Wavelet",
    "Gaussian",
    "gaussian",
    "Kernel",
    "Profile",
    "GaussianProfile",
    "DiracProfile",
    "UniformProfile",
    "BoxProfile",
    "Separable",
    "point_light",
    "spot_light",
    "Environment",
    "Harmonics",
    "NearLight",
    "HalfPlane",
    "half_plane",
    "SoftEdge",
    "Bars",
    "Grating",
    "SoftSlit",
    "Spline",
]
