"""Every still draws at a small size, goes on where it was ended, and is not drawn twice."""

import dataclasses
import sys
import types

import jax
import jax.numpy as jnp
import matplotlib.image
import numpy as np
import pytest

from docs.generate import stills as page
from firstorder.flatland import Receiver, irradiance, nearest
from gallery import frame as framing
from gallery.__main__ import Options, draw, main, names, title
from gallery.frame import Frame, developed
from gallery.stills import flux
from gallery.stills._tubes import spread


@pytest.mark.slow
@pytest.mark.parametrize("name", names())
def test_a_still_is_drawn_and_shows_something(name, tmp_path, capsys):
    small = Options(width=96, out=tmp_path)  # half of quick: what is left is to compile
    file = draw(name, small)
    picture = matplotlib.image.imread(file)[..., :3]
    assert picture.shape == (54, 96, 3)
    assert picture.std() > 0.02
    assert np.mean(np.ptp(picture, axis=-1)) > 0.005  # in colour
    capsys.readouterr()
    draw(name, small)
    assert "finished before" in capsys.readouterr().out


def test_a_field_is_the_same_when_it_goes_on(tmp_path):
    frame = Frame(32, 18, tmp_path / "a", "key")
    asked = []

    def at(p):
        asked.append(1)
        return p[0] * p[1]

    whole = frame.field(at, (0.0, 2.0, 0.0, 1.0))
    sorted((tmp_path / "a").glob("*.npz"))[1].unlink()
    np.testing.assert_array_equal(frame.field(at, (0.0, 2.0, 0.0, 1.0)), whole)
    # Means over pixels of a bilinear function are its values in their middles.
    x, y = np.meshgrid((np.arange(32) + 0.5) / 16, (np.arange(18) + 0.5) / 18, indexing="ij")
    np.testing.assert_allclose(whole, x * y, rtol=0.0, atol=1e-3)
    # A cubic spline errs by about (k h)^4 / 384 of a wave of wave number k.
    fine = dataclasses.replace(frame, folder=tmp_path / "b").field(
        lambda p: jnp.cos(jnp.pi * p[0]), (0.0, 2.0, 0.0, 1.0), rows=1, every=2
    )
    np.testing.assert_allclose(fine, np.cos(np.pi * x), rtol=0.0, atol=(np.pi / 8) ** 4 / 384)


def test_a_still_that_was_killed_is_the_same_to_the_byte(tmp_path, monkeypatch):
    """Six tiles; the run dies in the third, and the next one does the other four."""

    def still(frame):
        def at(p):
            return 1.0 + jnp.stack([jnp.cos(9.0 * p[0]), p[0] * p[1], p[1] ** 2])

        return developed(frame.field(at, (0.0, 2.0, 0.0, 1.0), rows=1))

    monkeypatch.setitem(sys.modules, "gallery.stills.shafts", types.SimpleNamespace(still=still))
    worked, dies, real = [], [True], framing.host_blocks

    def host_blocks(*args):
        if dies[0] and len(worked) == 2:
            raise KeyboardInterrupt
        worked.append(1)
        return real(*args)

    monkeypatch.setattr(framing, "host_blocks", host_blocks)
    killed, whole = (Options(width=512, out=tmp_path / n) for n in ("killed", "whole"))
    with pytest.raises(KeyboardInterrupt):
        draw("shafts", killed)
    assert not (killed.out / "shafts.png").exists()
    dies[0] = False
    again = draw("shafts", killed).read_bytes()
    assert len(worked) == 6
    assert again == draw("shafts", whole).read_bytes()
    assert len(worked) == 12


@pytest.mark.slow
def test_tubes_that_end_on_a_body_carry_what_it_receives(monkeypatch):
    """The net flux has no divergence: lines on each body are its power, to one line."""
    monkeypatch.setattr(flux, "STEP", 0.1)
    monkeypatch.setattr(flux, "STEPS", 150)
    world, share = flux.scene((1.0, 1.0)), 0.15
    found = [flux.cut(world, line) for line in flux.lines(world, flux.starts(world, share))]
    a, b = np.swapaxes([line[-2:] for line in found], 0, 1)
    met = nearest(world, a, (b - a) / np.linalg.norm(b - a, axis=1, keepdims=True))
    ended = np.asarray(met.index)[np.asarray(met.t) <= 0.1]
    s = (jnp.arange(200) + 0.5) / 200

    @jax.jit
    def power(k):
        def at(s):
            return irradiance(world, Receiver.on_shape(world, k, s)) * world.frame(k, s).speed

        return jnp.mean(jax.vmap(at)(s))

    for k in range(len(flux.LAMPS) + 1, world.count):
        assert abs(np.sum(ended == k) - power(jnp.asarray(k)).item() / share) < 1.0
    assert np.sum(ended > len(flux.LAMPS)) > 15


def test_a_tube_keeps_its_flux():
    """Straight and through a fold: width times fluence is what it carries, in each row."""
    extent = (0.0, 16.0, 0.0, 9.0)
    start = np.array([[3.0, 10.0], [4.37, 10.0], [5.0, 10.0]])
    for end in ([[3.0, -1.0], [4.37, -1.0], [5.0, -1.0]], [[8.0, -1.0], [7.0, -1.0], [9.5, -1.0]]):
        image = np.zeros((90, 160))
        p = np.stack([start, np.array(end)])
        spread(image, p, np.array([1.0, 2.0]), extent)
        way = p[1] - p[0]
        slant = np.abs(way[:-1, 1]) / np.hypot(*way[:-1].T)
        for row in (0, 44, 89):
            assert image[row].sum() * 0.1 == pytest.approx(np.sum([1.0, 2.0] / slant), rel=1e-9)


def test_unknown_stills_are_refused_and_all_are_listed(capsys, tmp_path):
    assert main(Options(names=("nothing",))) == 2
    assert "no still called 'nothing'" in capsys.readouterr().err
    assert main(Options(list=True, out=tmp_path)) == 0
    out = capsys.readouterr().out
    assert [n for n in names() if n not in out or not title(n)] == []


def test_the_page_shows_every_still():
    text = page.pages()["stills.md"]
    assert [n for n in names() if f"python -m gallery {n}`" not in text] == []
