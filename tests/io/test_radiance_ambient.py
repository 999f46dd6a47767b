import jax
import numpy as np
import pytest

from firstorder.caching import Cache, Candidates, elliptic_regions
from firstorder.io.radiance_ambient import (
    AmbientRecords,
    _ambient_from_text,
    _ambient_to_text,
    ambient_from_cache,
    cache_from_ambient,
    read_ambient,
    write_ambient,
)

# As `lookamb -d` prints them: tabs, six decimals, values with exponents.
HEADER = "#?RADIANCE\nrtrace -ab 1 -aa .1 box.oct\nSOFTWARE= RADIANCE\nFORMAT=ascii\n\n"
ROW = (
    "0.250000\t0.500000\t0.000000\t0.000000\t0.000000\t1.000000\t0.600000\t0.800000\t0.000000\t"
    "0\t1.000000\t0.300000\t0.700000\t1.000000e-01\t1.000000e-01\t1.000000e-01\t"
    "0.500000\t-0.250000\t0.000000\t0.000000\t0\n"
)
BEFORE = "0.25 0.5 0 0 0 1 0 1.0 0.3 .1 .1 .1 0.5 -0.25 0 0 0 0\n"
FLOOR = np.zeros(3), np.eye(3)
PLACES = np.random.default_rng(0).uniform(size=(9, 2))


@pytest.fixture(scope="module")
def cache():
    some = Candidates.from_function(lambda x: 1.0 + x[0] ** 2 * x[1] + x[1] ** 3, PLACES)
    return Cache.of(some, jax.jit(lambda H: elliptic_regions(H, 0.01, 0.1, 0.6))(some.hessian))


@pytest.mark.smoke
@pytest.mark.parametrize("text", [ROW, HEADER + ROW, (HEADER + ROW).replace("\n", "\r\n")])
def test_a_record_is_read_column_by_column(text):
    found = _ambient_from_text(text)
    assert found.count == 1
    np.testing.assert_allclose(found.u, [[0.6, 0.8, 0.0]])
    np.testing.assert_allclose(found.radii, [[0.3, 0.7]])
    cache = cache_from_ambient(found, *FLOOR)
    assert cache.records.value[0] == pytest.approx(0.1 * np.pi, rel=1e-6)
    # v = normal x u = (-0.8, 0.6): half the value per metre along u, minus a quarter along v.
    g = 0.1 * np.pi * (0.5 * np.array([0.6, 0.8]) - 0.25 * np.array([-0.8, 0.6]))
    np.testing.assert_allclose(cache.records.gradient[0], g, rtol=1e-6)
    lengths, angle = cache.region.axes()
    np.testing.assert_allclose(lengths, [[0.7, 0.3]])
    assert np.tan(angle[0]) == pytest.approx(0.6 / -0.8)


def test_the_form_of_older_releases_is_read_as_circles():
    cache = cache_from_ambient(_ambient_from_text(BEFORE), *FLOOR)
    np.testing.assert_allclose(cache.region.matrix[0], np.eye(2) / 0.3)
    np.testing.assert_allclose(
        cache.records.gradient[0], 0.1 * np.pi * np.array([0.5, -0.25]), rtol=1e-6
    )


def test_radii_that_are_one_but_for_their_digits_are_read():
    """A radius of 200 m, written in single precision."""
    row = ROW.replace("0.300000\t0.700000", "200.001\t200.000")
    np.testing.assert_allclose(_ambient_from_text(row).radii, [[200.0, 200.0]], rtol=1e-5)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_cache_comes_back_as_it_was_in_any_orientation(cache, tmp_path, side):
    turned, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))
    turned[:, 2] = side * np.cross(turned[:, 0], turned[:, 1])
    place = np.array([1.0, 2.0, 3.0]), turned
    write_ambient(tmp_path / "box.txt", ambient_from_cache(cache, *place, accuracy=0.2))
    back = cache_from_ambient(read_ambient(tmp_path / "box.txt"), *place, accuracy=0.2)
    for name in ("position", "value", "gradient", "matrix"):
        a, b = (getattr(c.region if name == "matrix" else c.records, name) for c in (back, cache))
        np.testing.assert_allclose(a, b, rtol=1e-6, atol=1e-6, err_msg=name)


def test_records_of_other_planes_and_levels_are_left_out(cache):
    records = ambient_from_cache(cache, *FLOOR)
    wall = ROW.replace("0.000000\t0.000000\t1.000000\t0.6", "0.000000\t0.000000\t-1.00000\t0.6")
    text = _ambient_to_text(records) + wall + ROW.replace("\t0\t1.0", "\t2\t1.0", 1)
    found = _ambient_from_text(text)
    assert found.count == cache.count + 2
    assert cache_from_ambient(found, *FLOOR).count == cache.count
    with pytest.raises(ValueError, match=r"^Argument `records` must hold some on the plane"):
        cache_from_ambient(found, np.array([0.0, 0.0, 9.0]), np.eye(3))


@pytest.mark.parametrize("fault", ["v on the other side", "gradient not relative", "no pi"])
def test_a_fault_in_the_convention_is_noticed(cache, fault):
    good = ambient_from_cache(cache, *FLOOR)
    E = np.asarray(cache.records.value)[:, None]
    change = {
        "v on the other side": {"gradient": good.gradient * np.array([1.0, -1.0])},
        "gradient not relative": {"gradient": good.gradient * E},
        "no pi": {"value": good.value * np.pi},
    }[fault]
    bad = AmbientRecords(**{**good.__dict__, **change})
    errors = [
        np.max(np.abs(np.asarray(back.records.gradient - cache.records.gradient)))
        for back in (cache_from_ambient(r, *FLOOR) for r in (good, bad))
    ]
    assert errors[0] < 1e-6 < 1e-2 < errors[1]


def test_values_of_zero_have_no_gradient(cache):
    dark = Cache.of(Candidates.of(PLACES, np.zeros(9), np.zeros((9, 2))), cache.region)
    assert np.all(ambient_from_cache(dark, *FLOOR).gradient == 0.0)


def broken(column, word):
    words = ROW.split()
    words[column] = word
    return ROW + "\t".join(words) + "\n"


@pytest.mark.smoke
@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", r"^text: there are no records.$"),
        ("1 2 3\n", r"^text, line 1: a record must have 21 columns, or 18, but has 3.$"),
        (ROW + "1 2\n", r"^text, line 2: a record must have 21 columns here, but has 2.$"),
        (broken(0, "here"), r"^text, line 2: a column must be a finite number, but is 'here'.$"),
        (broken(13, "nan"), r"^text, line 2: a column must be a finite number, but is 'nan'.$"),
        (broken(9, "0.5"), r"^text, line 2: the level must be a whole number in \[0, 2\^32\), but"),
        (broken(9, "1e19"), r"the level must be a whole number in \[0, 2\^32\), but is 1e\+19\.$"),
        (broken(20, "-1"), r"^text, line 2: the corral must be a word of 32 bits, but is -1\.$"),
        (broken(20, "0.5"), r"the corral must be a word of 32 bits, but is 0\.5\.$"),
        (broken(20, "4294967296"), r"the corral must be a word of 32 bits, but is 4\.29"),
        (broken(10, "2"), r"^text, line 2: the weight must lie in \(0, 1\], but is 2.$"),
        (broken(11, "0"), r"^text, line 2: a radius must be positive, but is 0.$"),
        (broken(11, "0.9"), r"^text, line 2: the first radius must not exceed the second, but is"),
        (broken(14, "-1"), r"^text, line 2: a value must not be negative, but is -1.$"),
        (broken(5, "0"), r"^text, line 2: the normal must not be zero.$"),
        (HEADER.replace("ascii", "Radiance_ambval"), r"line 4: the format must be ascii, but is"),
        ("#?RADIANCE\nFORMAT=ascii\n0 0", r"^text: the header does not end: an empty line is miss"),
    ],
)
def test_bad_files_get_one_sentence(text, words):
    with pytest.raises(ValueError, match=words):
        _ambient_from_text(text)


def turned(u):
    """The record with another direction u, to four places."""
    words = ROW.split()
    words[6:9] = [f"{number:.4f}" for number in u]
    return "\t".join(words) + "\n"


@pytest.mark.parametrize("u", [(0, 0, 0), (0, 0, -2), (0.0009, 0, 1)])
def test_a_direction_of_no_length_across_the_normal_is_refused(u):
    with pytest.raises(ValueError, match=r"^text, line 1: u must not be zero or along the normal"):
        _ambient_from_text(turned(u))


@pytest.mark.parametrize("height", [0.0, 1.0, -1.0])
def test_a_direction_of_little_length_across_the_normal_is_turned_into_the_plane(height):
    found = _ambient_from_text(turned((0.0009, 0.0012, height)))
    np.testing.assert_allclose(found.u, [[0.6, 0.8, 0.0]], rtol=1e-12)


@pytest.mark.smoke
def test_a_binary_file_is_told_apart(tmp_path):
    (tmp_path / "a.amb").write_bytes(b"#?RADIANCE\nFORMAT=Radiance_ambval\n\n\xff\xfe\x00\x81")
    with pytest.raises(ValueError, match=r"^a.amb: the text form of an ambient file is expected"):
        read_ambient(tmp_path / "a.amb")
    with pytest.raises(FileNotFoundError, match=r"b\.amb: the file cannot be opened \(no such"):
        read_ambient(tmp_path / "b.amb")
