import numpy as np

from figures.e11.shared import picture, space
from figures.r07.shared.look import GROUND
from firstorder.io.images import LUMINANCE


def test_four_scenes_have_every_pixel_of_the_finer_one_once():
    fine = space.grids(16)
    places = picture.interleaved(fine)
    assert [s.side for s in places] == [8] * 4
    together = np.concatenate([s.receivers for s in places])
    assert np.allclose(np.sort(together, 0), np.sort(fine.receivers, 0), equal_nan=True)
    whole = fine.receivers.reshape(16, 16, 3)
    assert np.allclose(places[1].receivers.reshape(8, 8, 3)[2, 3], whole[4, 7], equal_nan=True)
    assert places[0].pixel == 2.0 * fine.pixel


def test_film_is_the_mean_of_its_places_and_a_ground_where_nothing_is():
    places = [s._replace(part=s.part.copy()) for s in picture.interleaved(space.grids(16))]
    for s in places:
        s.part[0] = -1  # the first pixel of the first column: below on the left
    seen = [np.full((8, 8), share) for share in (0.0, 0.0, 1.0, 1.0)]
    film = picture.Film.of(places, [np.ones((8, 8))] * 4)
    half, dark = film.levels(seen), film.levels([np.zeros((8, 8))] * 4)
    assert np.array_equal(half[-1, 0], GROUND[0])
    assert np.all(dark[0, -1] == 0)
    light = [s.picture(s.light())[5, 5] for s in places]
    lit = picture._colour(places, seen)[0][5, 5]
    assert np.isclose(lit @ LUMINANCE, 0.25 * sum(light[2:]))
