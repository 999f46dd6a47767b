"""Shadow rays in a file: back to the bit, small, and wrong files refused in one sentence."""

import numpy as np
import pytest

from firstorder.io.rays import BYTES_A_RAY, read_rays, write_rays
from firstorder.shadowfield.rendering.lamp import lamp_frame
from firstorder.shadowfield.rendering.ray_table import trace_shadow_rays

LAMP = lamp_frame((0.1, 0.2, 4.0), (0.0, 0.8, 0.0), (0.4, 0.0, 0.3))


def table(count=100):
    def some(a, b):
        hit = np.arange(len(a)) % 3 == 0
        return np.where(hit, 0.3, np.inf), np.where(hit, 0.6, -np.inf)

    return trace_shadow_rays(LAMP, np.random.default_rng(0).random((count, 3)), 2, some)[0]


@pytest.mark.smoke
def test_rays_come_back_to_the_bit(tmp_path):
    rays = table()
    write_rays(tmp_path / "a.rays", LAMP, rays)
    lamp, found = read_rays(tmp_path / "a.rays")
    for a, b in zip((*LAMP, *rays), (*lamp, *found), strict=True):
        assert a.dtype == b.dtype
        assert np.ascontiguousarray(a).tobytes() == np.ascontiguousarray(b).tobytes()


def test_the_papers_637000_rays_take_a_twentieth_more_than_its_17_MB(tmp_path):
    rays = table()
    write_rays(tmp_path / "a.rays", LAMP, rays)
    size = (tmp_path / "a.rays").stat().st_size
    assert size == 136 + BYTES_A_RAY * len(rays.near)
    assert 17e6 < 637_000 * BYTES_A_RAY < 1.05 * 17e6


def test_blockers_on_the_lamp_itself_come_back(tmp_path):
    """`trace_shadow_rays` makes such rays: a thing in the lamp's plane hides it at the depth 0."""

    def on_the_lamp(a, b):
        return np.zeros(len(a)), np.full(len(a), 0.5)

    rays, _ = trace_shadow_rays(LAMP, np.zeros((3, 3)), 2, on_the_lamp)
    assert np.all(rays.near == 0.0)
    write_rays(tmp_path / "a.rays", LAMP, rays)
    np.testing.assert_array_equal(read_rays(tmp_path / "a.rays")[1].near, rays.near)
    write_rays(tmp_path / "b.rays", LAMP, rays._replace(near=rays.near - np.float32(1e-3)))
    with pytest.raises(ValueError, match="a ray is none"):
        read_rays(tmp_path / "b.rays")


def test_no_rays_are_a_file_too(tmp_path):
    write_rays(tmp_path / "a.rays", LAMP, type(table())(*(a[:0] for a in table())))
    assert len(read_rays(tmp_path / "a.rays")[1].near) == 0


def test_an_old_file_stays_if_writing_fails(tmp_path):
    file = tmp_path / "a.rays"
    write_rays(file, LAMP, table())
    before = file.read_bytes()
    with pytest.raises((ValueError, TypeError)):
        write_rays(file, LAMP, table()._replace(far=np.array(["x"])))
    assert file.read_bytes() == before
    assert [f.name for f in tmp_path.iterdir()] == ["a.rays"]


def changed(data, at, value):
    return data[:at] + value + data[at + len(value) :]


def last(data, columns):
    """Where the first number of the last columns but some is."""
    count = (len(data) - 136) // 28
    return len(data) - 4 * count * columns


NAN = np.array([np.nan], "<f4").tobytes()
WRONG = {
    "other": (lambda d: b"PNG" + d, "does not begin so"),
    "empty": (lambda d: b"", "does not begin so"),
    "short": (lambda d: d[:-1], "rays take"),
    "long": (lambda d: d + b"0", "rays take"),
    "huge": (lambda d: changed(d, 8, b"\xff" * 8), "rays take"),
    "frame": (lambda d: changed(d, 48, bytes(8)), "frame is none"),
    "edges": (lambda d: changed(d, 112, bytes(16)), "frame is none"),
    "nan": (lambda d: changed(d, 136, NAN), "a ray is none"),
    "order": (lambda d: changed(d, last(d, 2), np.array([9.0], "<f4").tobytes()), "a ray is none"),
    "start": (lambda d: changed(d, last(d, 1), np.array([0.1], "<f4").tobytes()), "a ray is none"),
    "former": (lambda d: b"1storay1" + d[8:], "first edition"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_files_are_refused_in_one_sentence(tmp_path, name):
    write_rays(tmp_path / "a.rays", LAMP, table(99))
    spoil, words = WRONG[name]
    file = tmp_path / "b.rays"
    file.write_bytes(spoil((tmp_path / "a.rays").read_bytes()))
    with pytest.raises(ValueError, match=words) as error:
        read_rays(file)
    assert str(error.value).startswith("b.rays: ")
    assert str(error.value).count("\n") == 0


def test_other_endings_are_refused(tmp_path):
    with pytest.raises(ValueError, match=r"\.rays files"):
        write_rays(tmp_path / "a.npz", LAMP, table())
    with pytest.raises(ValueError, match=r"\.rays files"):
        read_rays(tmp_path / "a.npz")
