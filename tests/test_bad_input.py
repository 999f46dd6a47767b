import jax
import jax.numpy as jnp
import numpy as np
import pytest

from firstorder.bandwidth import (
    band_limit,
    blocker_distance,
    glossy_bandwidth,
    glossy_bandwidth_in_space,
    glossy_criterion,
    occluded_bandwidth,
    occluded_criterion,
)
from firstorder.conventions import FLATLAND, FLATLAND_SLOPE, SPACE, Frame
from firstorder.fields import (
    Affine,
    Bars,
    BoxProfile,
    Gaussian,
    GaussianProfile,
    Grating,
    Grid,
    NearLight,
    SampledSpectrum,
    SoftEdge,
    SoftSlit,
    Wavelet,
    gaussian,
    half_plane,
)
from firstorder.fields._haar import haar_matrix
from firstorder.flatland import diffuse_brdf, phong_brdf
from firstorder.flatland._radiometry import foreshortening
from firstorder.imaging import Lamp, SurfaceReflectance
from firstorder.laws import Convolve, Integrate, Move, VonMisesFisher
from firstorder.sampling import (
    CosineDirections,
    CosinePowerLobe,
    PiecewiseConstant,
    UniformDirections,
)
from firstorder.shadowfield import (
    replicas_overlap,
    sampling_rates,
    sheared_filter,
    wedge_corners,
)
from firstorder.space.library import sphere_over_plane
from firstorder.transport import (
    ClampedCosine,
    Curvature,
    Fresnel,
    Ggx,
    LobeBrdf,
    Mirror,
    Reflection,
    Schlick,
    Snell,
    TabulatedBrdf,
    Transmission,
    Travel,
    VaryingGaussian,
    comb_blocker,
    diffuse,
    fresnel_reflection,
    glossy,
    grating_blocker,
    half_plane_blocker,
    lambert,
    phong,
    refraction,
    retro,
    slit_blocker,
    wave,
)
from firstorder.transport.brdf.lobes import TabulatedProfile
from firstorder.transport.events.diffuse import Gather
from firstorder.transport.shading._horizon import AboveLine
from firstorder.transport.shading.surface import far_light_ratio
from firstorder.visibility import bracket_edges

LIGHT = gaussian((0.1, 0.0), (1.0, 0.5), frame=FLATLAND)
NARROW = sheared_filter(1.0, 0.25, 0.5, Omega_y_max=2.0, Omega_pix=16.0)
NARROW_RATES = sampling_rates(NARROW, wedge_corners(1.0, 0.25, 0.5, 8.0))
OUT = gaussian((0.1, 0.0), (1.0, 0.5), frame=FLATLAND.turned())

WRONG = {
    "negative distance": lambda: Travel(-1.0),
    "infinite distance": lambda: Travel(jnp.inf),
    "NaN curvature": lambda: Curvature(jnp.nan),
    "singular matrix": lambda: Move([[1.0, 2.0], [2.0, 4.0]]),
    "NaN matrix": lambda: Move([[1.0, jnp.nan], [0.0, 1.0]]),
    "shift of the wrong size": lambda: Move(np.eye(2), [1.0, 2.0, 3.0]),
    "matrix that is a vector": lambda: Move([1.0, 2.0]),
    "width of zero": lambda: gaussian((0.0, 0.0), (0.0, 1.0)),
    "negative lobe": lambda: GaussianProfile(-0.1),
    "NaN lobe": lambda: GaussianProfile(jnp.nan),
    "no bell": lambda: Gaussian(jnp.zeros(2), jnp.array([[1.0, 2.0], [2.0, 1.0]])),
    "not symmetric": lambda: Gaussian(jnp.zeros(2), jnp.array([[1.0, 0.5], [0.0, 1.0]])),
    "centre of the wrong size": lambda: Gaussian(jnp.zeros(3), jnp.eye(2)),
    "empty grid": lambda: Grid((0, 4), (1.0, 1.0)),
    "grid of no axes": lambda: Grid((), ()),
    "negative step": lambda: Grid((4, 4), (1.0, -1.0)),
    "steps of the wrong number": lambda: Grid((4, 4), (1.0,)),
    "samples of the wrong shape": lambda: SampledSpectrum(
        jnp.zeros((3, 3)), Grid((4, 4), (1.0, 1.0)), FLATLAND
    ),
    "no nodes": lambda: Integrate("theta", -1.0, 1.0, 0),
    "unknown axis": lambda: Integrate("phi", -1.0, 1.0)(LIGHT).frame,
    "unknown axis of a kernel": lambda: GaussianProfile(0.1, "z"),
    "transparency above one": lambda: half_plane_blocker(0.0, FLATLAND, 1.5),
    "Haar of three": lambda: haar_matrix(3),
    "wavelets of an odd grid": lambda: Wavelet.of(LIGHT, Grid((6, 8), (1.0, 1.0))),
    "too few coordinates": lambda: LIGHT(1.0),
    "mirror of mirrored light": lambda: Mirror()(OUT),
    "lobe on light that is not mirrored": lambda: Reflection(GaussianProfile(0.1))(LIGHT),
    "curvature in slopes": lambda: Curvature(1.0)(gaussian((0, 0), (1, 1), frame=FLATLAND_SLOPE)),
    "travel in angles of space": lambda: Travel(1.0)(
        Gaussian(jnp.zeros(4), jnp.eye(4), frame=SPACE)
    ),
    "sum over two frames": lambda: LIGHT + OUT,
    "blocker in other coordinates": lambda: half_plane_blocker(0.0, FLATLAND_SLOPE)(LIGHT),
    "half-plane on no axis": lambda: half_plane(0.0, axis="y"),
    "negative level": lambda: band_limit(ClampedCosine(), -2.0),
    "negative cutoff": lambda: glossy_bandwidth(-3.0, 2.0, 0.0, 1.0),
    "NaN cutoff": lambda: glossy_criterion(jnp.nan, 2.0, 0.0, 1.0),
    "negative factor": lambda: glossy_bandwidth(3.0, 2.0, 0.0, 1.0, -1.0),
    "NaN bend": lambda: glossy_bandwidth(3.0, 2.0, jnp.nan, 1.0),
    "negative light": lambda: occluded_bandwidth(3.0, 2.0, 0.0, 1.0, 1.0, light=-1.0),
    "negative cosine": lambda: occluded_bandwidth(3.0, 2.0, 0.0, 1.0, 1.0, -0.5),
    "negative cutoff of eq. 21": lambda: occluded_criterion(-3.0, 2.0, 0.0, 1.0, 1.0),
    "infinite shape operator": lambda: glossy_bandwidth_in_space(
        1.0, 1.0, jnp.full((2, 2), jnp.inf), 1.0
    ),
    "frame without that coordinate": lambda: Frame(("x", "v")).without("theta"),
    "no edge of a slit": lambda: slit_blocker(None, 0.5, FLATLAND_SLOPE),
    "word for a period": lambda: comb_blocker("one", 3, FLATLAND_SLOPE),
    "a gathering without nodes": lambda: diffuse(nodes=0),
    "NaN albedo": lambda: SurfaceReflectance(jnp.nan),
    "negative exponent": lambda: SurfaceReflectance(0.5, 0.2, -1.0),
    "NaN shift": lambda: Lamp((0, 0, 2), (0, 1, 0), (1, 0, 0), shift=(jnp.nan, 0.0)),
    "NaN angle": lambda: bracket_edges(lambda a: a > 0.0, jnp.array([-1.0, jnp.nan])),
    "NaN point": lambda: blocker_distance(
        sphere_over_plane(), jnp.full((1, 3), jnp.nan), jnp.eye(3)[None], jnp.array([-1])
    ),
    "NaN direction": lambda: blocker_distance(
        sphere_over_plane(), jnp.eye(3)[:1], jnp.full((1, 2, 3), jnp.nan), jnp.array([-1])
    ),
    "NaN corner": lambda: replicas_overlap(NARROW, [[jnp.nan, 0.0]] * 3, NARROW_RATES),
}


@pytest.mark.parametrize("wrong", WRONG.values(), ids=WRONG)
def test_bad_input_gets_one_sentence(wrong):
    with pytest.raises((ValueError, TypeError)) as caught:
        wrong()
    message = str(caught.value)
    assert message.endswith(".")
    assert "\n" not in message
    assert 10 < len(message) < 130
    assert "must" in message or "needs" in message


FLAT = gaussian((0.1, 0.0), (1.0, 0.5), frame=FLATLAND_SLOPE)
LEVEL = Affine(np.array([1.0, 0.0]), 0.0, FLATLAND)
BALL = Gaussian([0.0], [[1.0]], frame=Frame(("x",)))
T = jnp.array(0.2)


def lit(event, light=LIGHT):
    """Value and derivatives after an event."""
    jet = event(light).jet(jnp.array([0.3, 0.2]))
    return jet.value, jet.gradient, jet.hessian


def field(f):
    """Value and derivatives of a field."""
    jet = f.jet(jnp.array([0.3, 0.2]))
    return jet.value, f.at(jnp.array([0.3, 0.2]))


def masked(event):
    return lit(event, FLAT)[0]


def profile(lobe):
    kernel = lobe.kernel
    return *kernel.derivatives(T), kernel.transform(T)


# What is made of one traced number: one that is out of range, and one that is in it.
RANGES = {
    "distance": (lambda d: lit(Travel(d), FLAT), -1.0, 1.0),
    "lobe": (lambda s: Convolve(GaussianProfile(s))(LIGHT)(0.1, 0.2), -1.0, 1.0),
    "light": (lambda s: gaussian((0.0, 0.0), (s, 1.0))(0.1, 0.2), -1.0, 1.0),
    "Fresnel": (lambda eta: Fresnel(eta).derivatives(T), -1.5, 1.5),
    "Fresnel below the horizon": (lambda eta: Fresnel(eta)(0.0, 2.0), -1.5, 1.5),
    "Transmission": (lambda eta: Transmission(eta).derivatives(T), -1.5, 1.5),
    "Schlick": (lambda R0: Schlick(R0).derivatives(T), 1.2, 0.2),
    "Schlick below the horizon": (lambda R0: Schlick(R0)(0.0, 2.0), -0.2, 0.2),
    "Snell": (lambda eta: lit(Snell(eta)), -1.5, 1.5),
    "Snell of index zero": (lambda eta: lit(Snell(eta)), 0.0, 0.5),
    "refraction": (lambda eta: lit(refraction(eta)), -1.5, 1.5),
    "fresnel_reflection": (lambda eta: lit(fresnel_reflection(eta)), -1.5, 1.5),
    "half-plane": (lambda V: masked(half_plane_blocker(0.5, FLATLAND_SLOPE, V)), 1.7, 0.7),
    "half-plane, open side": (
        lambda V: masked(half_plane_blocker(0.1, FLATLAND_SLOPE, V)),
        -0.1,
        0.1,
    ),
    "slit": (lambda V: masked(slit_blocker(-0.5, 0.5, FLATLAND_SLOPE, V)), 1.7, 0.7),
    "slit inside out": (lambda r: masked(slit_blocker(-0.5, r, FLATLAND_SLOPE)), -0.6, 0.6),
    "comb": (lambda V: masked(comb_blocker(1.0, 3, FLATLAND_SLOPE, 0.5, V)), 1.7, 0.7),
    "comb's opening": (lambda o: masked(comb_blocker(1.0, 1, FLATLAND_SLOPE, o)), -0.4, 0.4),
    "comb's period": (lambda p: masked(comb_blocker(p, 3, FLATLAND_SLOPE)), -1.0, 1.0),
    "grating": (lambda V: masked(grating_blocker(1.0, FLATLAND_SLOPE, 0.5, V)), 1.7, 0.7),
    "grating's opening": (lambda o: masked(grating_blocker(1.0, FLATLAND_SLOPE, o)), 1.2, 0.2),
    "grating's period": (lambda p: field(Grating(LEVEL, p)), -1.0, 1.0),
    "bars": (lambda p: field(Bars(LEVEL, jnp.stack([0.0 * p, p]), [0.0, 1.0, 0.0])), -0.4, 0.4),
    "soft edge": (lambda s: field(SoftEdge(LEVEL, s)), -0.1, 0.1),
    "soft slit": (lambda w: field(SoftSlit(LEVEL, w, 0.1)), -1.0, 1.0),
    "soft slit's blur": (lambda b: field(SoftSlit(LEVEL, 1.0, b)), -0.1, 0.1),
    "soft slit's covariance": (lambda b: SoftSlit(LEVEL, 1.0, b).covariance().matrix, -0.1, 0.1),
    "Ggx": (lambda a: Ggx(a).derivatives(T, T), -0.3, 0.3),
    "phong": (lambda s: profile(phong(s)), 0.5, 1.5),
    "glossy": (lambda s: profile(glossy(s)), -0.5, 0.5),
    "retro": (lambda s: profile(retro(s)), -0.5, 0.5),
    "lambert": (lambda albedo: profile(lambert(albedo)), 1.5, 0.5),
    "varying lobe": (lambda m: field(VaryingGaussian(wave(0.5, 0.4, mean=m), 1.0)), -0.3, 0.6),
    "profile's spread": (lambda s: GaussianProfile(s).spread(), -0.4, 0.4),
    "phong's spread": (lambda s: phong(s).kernel.spread(), 0.4, 1.5),
    "table's step": (lambda h: field(TabulatedProfile([0.0, 1.0, 0.0], h)), -0.2, 0.2),
    "table's integral": (lambda p: field(TabulatedProfile([0.0 * p, p, 0.0], 0.2)), -1.0, 1.0),
    "box": (lambda w: field(BoxProfile(w)), -1.0, 1.0),
    "bell on the sphere": (lambda k: VonMisesFisher(k).derivatives(T), -3.0, 3.0),
    "height of a light": (lambda h: field(NearLight(jnp.stack([0.0 * h, h]), BALL)), -2.0, 2.0),
    "reach": (lambda r: Gather(reach=r)(FLAT)(0.3), -3.0, 3.0),
    "far light": (lambda D: far_light_ratio(D, 0.2, 0.25), -2.0, 2.0),
    "widest": (lambda w: VaryingGaussian(wave(0.5, 0.1, mean=0.3), w).half_width(), -0.4, 0.4),
    "cutoff": (lambda W: glossy_bandwidth(W, 2.0, 0.1, 1.0), -3.0, 3.0),
    "factor": (lambda f: glossy_bandwidth(3.0, 2.0, 0.1, 1.0, f), -1.0, 1.0),
    "distance of the eye": (lambda d: glossy_bandwidth(3.0, d, 0.1, 1.0), -2.0, 2.0),
    "cosine of the eye": (lambda c: glossy_bandwidth(3.0, 2.0, 0.1, c), 1.5, 0.5),
    "cutoff in space": (lambda W: glossy_bandwidth_in_space(W, 1.0, np.eye(2), 1.0), -3.0, 3.0),
    "cutoff of eq. 20": (lambda W: glossy_criterion(W, 2.0, 0.1, 1.0), -3.0, 3.0),
    "cutoff of eq. 21": (lambda W: occluded_criterion(W, 2.0, 0.1, 1.0, 1.0), -3.0, 3.0),
    "depth of eq. 21": (lambda z: occluded_criterion(3.0, 2.0, 0.1, 1.0, z), -1.0, 1.0),
    "cosine of the edge": (lambda c: occluded_bandwidth(3.0, 2.0, 0.1, 1.0, 1.0, c), -0.5, 0.5),
    "depth of the edge": (lambda z: occluded_bandwidth(3.0, 2.0, 0.1, 1.0, z), -1.0, 1.0),
    "light at the edge": (lambda W: occluded_bandwidth(3.0, 2.0, 0.1, 1.0, 1.0, 1.0, W), -1.0, 1.0),
}


@pytest.mark.parametrize(("make", "wrong", "right"), RANGES.values(), ids=RANGES)
def test_an_invalid_traced_argument_gives_nan_and_never_a_plausible_number(make, wrong, right):
    traced = jax.jit(make)
    for number in jax.tree.leaves(traced(wrong)):
        assert np.all(np.isnan(number))
    for number in jax.tree.leaves(traced(right)):
        assert np.all(np.isfinite(number))


def test_a_lobe_is_nan_where_its_width_is_negative_and_only_there():
    lobe = VaryingGaussian(wave(0.5, 0.4, mean=0.3), 0.7)
    assert np.isnan(lobe(1.0, 0.05))
    assert np.isfinite(lobe(0.0, 0.05))


# A direction that is NaN lies neither above the horizon nor below it: no number stands for it.
UNKNOWN = {
    "clamped cosine": lambda a: ClampedCosine()(0.0, a),
    "light above a line": lambda a: AboveLine(LIGHT)(0.1, a),
    "Fresnel": lambda a: Fresnel(1.5)(0.0, a),
    "Schlick": lambda a: Schlick(0.04)(0.0, a),
    "Transmission": lambda a: Transmission(1.5)(0.0, a),
    "Ggx, light": lambda a: Ggx(0.3)(a, 0.2),
    "Ggx, eye": lambda a: Ggx(0.3)(0.2, a),
    "lobe, light": lambda a: LobeBrdf(glossy(0.2))(a, 0.2),
    "lobe, eye": lambda a: LobeBrdf(glossy(0.2))(0.2, a),
    "table, light": lambda a: TabulatedBrdf(np.full((5, 6), 0.5))(a, 0.2),
    "table, eye": lambda a: TabulatedBrdf(np.full((5, 6), 0.5))(0.2, a),
    "Phong's lobe": lambda a: phong(5.0).kernel.derivatives(jnp.asarray(a))[0],
    "Lambert's lobe": lambda a: lambert(0.5).kernel.derivatives(jnp.asarray(a))[0],
    "flatland's diffuse": lambda a: diffuse_brdf(0.5)(a, 0.2),
    "flatland's Phong, light": lambda a: phong_brdf(0.5, 3.0)(a, 0.2),
    "flatland's Phong, eye": lambda a: phong_brdf(0.5, 3.0)(0.2, a),
    "foreshortening": foreshortening,
    "uniform directions": lambda a: UniformDirections().density(a),
    "cosine directions": lambda a: CosineDirections().density(a),
    "directions of a lobe": lambda a: CosinePowerLobe(3.0).density(a),
    "steps": lambda a: PiecewiseConstant([1.0, 2.0], 0.0, 1.0).density(a),
}


@pytest.mark.parametrize("density", UNKNOWN.values(), ids=UNKNOWN)
def test_a_direction_that_is_nan_is_told(density):
    assert np.isnan(density(jnp.nan))
    assert np.isfinite(density(0.4))
    assert density(2.0) in (0.0, 1.0)  # below the horizon, where all is reflected or nothing
