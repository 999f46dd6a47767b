"""What light is: a field, and the portraits that can be drawn of it."""

from firstorder.fields.covariance import Covariance, covariance_of, covariance_of_samples
from firstorder.fields.field import Affine, Constant, Edge, Field, Function, Sum
from firstorder.fields.gaussian import Gaussian, gaussian
from firstorder.fields.jet import Jet, autodiff_jet
from firstorder.fields.kernel import GaussianProfile, Kernel, Profile
from firstorder.fields.mask import HalfPlane, half_plane
from firstorder.fields.sampled import Sampled
from firstorder.fields.series import Series
from firstorder.fields.spectrum import Grid, SampledSpectrum, Spectrum, discrete_transform
from firstorder.fields.wavelet import Wavelet, haar_matrix, triple_products

__all__ = [
    "Affine",
    "Constant",
    "Covariance",
    "Edge",
    "Field",
    "Function",
    "Gaussian",
    "GaussianProfile",
    "Grid",
    "HalfPlane",
    "Jet",
    "Kernel",
    "Profile",
    "Sampled",
    "SampledSpectrum",
    "Series",
    "Spectrum",
    "Sum",
    "Wavelet",
    "autodiff_jet",
    "covariance_of",
    "covariance_of_samples",
    "discrete_transform",
    "gaussian",
    "half_plane",
    "haar_matrix",
    "triple_products",
]
