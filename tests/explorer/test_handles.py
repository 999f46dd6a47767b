"""A handle moves what it should, and nothing else."""

import dataclasses

import numpy as np
import pytest
from flatland_explorer import board as boards
from flatland_explorer import handles
from flatland_explorer.board import Board, Part, bent, board_of, first_board, fitted, sorted_board

from firstorder.flatland import Scene, library


def every_kind():
    """A board with a part of each kind."""
    first = first_board()
    bean = {
        "cosines": ((0.6, 1.0), (0.0, 0.2), (0.05, 0.0)),
        "sines": ((0.0, 0.0), (0.25, 0.0), (0.0, 0.04)),
        "samples": 64,
    }
    egg = {"center": (-0.9, 0.9), "semi": (0.2, 0.1), "tilt": 0.4}
    more = [
        Part("ellipse", egg, "egg", {"albedo": (0.5, 0.5)}),
        Part("curve", bean, "bean"),
        Part("point", {"position": (-1.2, 1.4), "intensity": 2.0}),
    ]
    return sorted_board(first, [*first.parts, *more], first.parts[first.receiver])


BOARD = every_kind()
NAMES = [n for n in handles.handles(BOARD) if not n.startswith("probe")]
# These follow the mouse only in one direction.
BOUND = ("bend", "normal", "rim")


@pytest.mark.parametrize("name", NAMES)
def test_a_handle_changes_its_part_alone(name):
    before = np.asarray(handles.handles(BOARD)[name])
    after = handles.move(BOARD, name, before + np.array([0.03, -0.02]))
    own = int(name.split(".")[0])
    assert after.parts[own] != BOARD.parts[own]
    assert [a is b for a, b in zip(after.parts, BOARD.parts, strict=True)] == [
        k != own for k in range(len(BOARD.parts))
    ]
    for key in ("receiver", "probe", "tilt", "window", "tolerance"):
        assert getattr(after, key) == getattr(BOARD, key)


@pytest.mark.parametrize("name", [n for n in NAMES if n.split(".")[1] not in BOUND])
def test_a_free_handle_is_where_it_was_moved(name):
    to = np.asarray(handles.handles(BOARD)[name]) + np.array([0.03, -0.02])
    after = handles.move(BOARD, name, to)
    np.testing.assert_allclose(handles.handles(after)[name], to, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("name", NAMES)
def test_a_handle_moved_nowhere_changes_nothing_that_is_seen(name):
    after = handles.move(BOARD, name, handles.handles(BOARD)[name])
    for a, b in zip(after.parts, BOARD.parts, strict=True):
        np.testing.assert_allclose(a.outline(), b.outline(), rtol=0.0, atol=1e-12)


def test_a_body_keeps_its_shape():
    for k, part in enumerate(BOARD.parts):
        after = handles.move(BOARD, f"{k}.body", part.middle + np.array([0.1, 0.2])).parts[k]
        np.testing.assert_allclose(
            after.outline() - part.outline(), 0.0 * part.outline() + np.array([0.1, 0.2])
        )


def index(name):
    return next(k for k, part in enumerate(BOARD.parts) if part.name == name)


def test_a_normal_turns_a_segment_about_its_middle_towards_the_mouse():
    k = index("lamp")
    before = BOARD.parts[k]
    after = handles.move(BOARD, f"{k}.normal", before.middle + np.array([3.0, -4.0])).parts[k]
    a, b = np.asarray(after.numbers["start"]), np.asarray(after.numbers["end"])
    np.testing.assert_allclose(after.middle, before.middle)
    np.testing.assert_allclose(np.hypot(*(b - a)), 1.0)
    e = b - a
    np.testing.assert_allclose([-e[1], e[0]], [0.6, -0.8])


def test_a_bend_keeps_both_ends_and_passes_the_mouse_by_its_height():
    k = index("mirror")
    start, _, end = BOARD.parts[k].outline(2)
    along = (end - start) / np.hypot(*(end - start))
    across = np.array([-along[1], along[0]])
    for height in (0.2, -0.1, 0.004, -1e-9, 0.0):
        to = 0.5 * (start + end) + height * across + 0.05 * along
        part = handles.move(BOARD, f"{k}.bend", to).parts[k]
        p, q, r = part.outline(2)
        np.testing.assert_allclose([p, r], [start, end], rtol=0.0, atol=1e-9)
        least = boards.FLATTEST * np.hypot(*(end - start))
        got = (q - 0.5 * (start + end)) @ across
        assert part.kind == "arc"
        np.testing.assert_allclose(
            got, np.copysign(max(abs(height), least), height), rtol=0.0, atol=1e-9
        )
    half = handles.move(BOARD, f"{k}.bend", start + 9.0 * across).parts[k]
    np.testing.assert_allclose(abs(half.numbers["sweep"]), np.pi)


def test_an_end_of_an_arc_keeps_the_other_end_and_the_bend_of_the_chord():
    k = index("mirror")

    def share(part):
        a, m, b = part.outline(2)
        e = b - a
        return (m - 0.5 * (a + b)) @ np.array([-e[1], e[0]]) / (e @ e)

    after = handles.move(BOARD, f"{k}.end", (0.9, 1.4)).parts[k]
    np.testing.assert_allclose(after.outline(2)[0], BOARD.parts[k].outline(2)[0])
    np.testing.assert_allclose(share(after), share(BOARD.parts[k]))


def test_nothing_shrinks_to_a_point():
    k = index("strip")
    part = handles.move(BOARD, f"{k}.end", BOARD.parts[k].numbers["start"]).parts[k]
    assert np.hypot(*np.diff(part.outline(), axis=0)[0]) > 1e-3
    k = index("disc")
    part = handles.move(BOARD, f"{k}.rim", BOARD.parts[k].numbers["center"]).parts[k]
    assert part.numbers["radius"] > 1e-3
    places = handles.handles(BOARD)
    for name in NAMES:
        for other in places:
            if other.split(".")[0] == name.split(".")[0]:
                assert isinstance(handles.move(BOARD, name, places[other]).scene(), Scene)


def test_the_probe_slides_along_the_receiver_and_tilts():
    after = handles.move(BOARD, "probe.place", (0.5, 3.0))
    assert after.probe == pytest.approx(0.75)
    assert after.parts == BOARD.parts
    place, n = handles.probe_frame(after)
    tilted = handles.move(after, "probe.normal", place + np.array([-1.0, 1.0]))
    assert (n, tilted.tilt) == pytest.approx((0.0, 0.25 * np.pi))
    assert abs(handles.move(after, "probe.normal", place - [0.1, 1.0]).tilt) == 1.4
    assert 0.0 < handles.move(BOARD, "probe.place", (-9.0, 0.0)).probe < 0.01


@pytest.mark.parametrize("name", ["segment", "arc", "circle", "ellipse", "curve"])
def test_the_probe_stands_where_the_scene_has_it(name):
    k = next(i for i, part in enumerate(BOARD.parts) if part.kind == name)
    board = dataclasses.replace(handles.received_by(BOARD, k), probe=0.3125)
    place, n = handles.probe_frame(board)
    frame = board.scene().frame(k, 0.3125)
    np.testing.assert_allclose(place, frame.position, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(np.exp(1j * n), np.exp(1j * float(frame.n)), rtol=0.0, atol=1e-12)


def test_a_press_takes_the_nearest_handle_or_else_a_line():
    k, end = index("strip"), np.asarray(BOARD.parts[index("strip")].numbers["end"])
    assert handles.grabbed(BOARD, end + 0.01, 0.02) == f"{k}.end"
    between = 0.6 * end + 0.4 * np.asarray(BOARD.parts[k].numbers["start"])
    assert handles.grabbed(BOARD, between + np.array([0.0, 0.005]), 0.02) == f"{k}.body"
    assert handles.grabbed(BOARD, (0.6, 0.3), 0.02) is None


@pytest.mark.parametrize("what", ["lamp", "strip", "disc", "mirror", "point"])
def test_a_part_comes_and_goes_and_the_receiver_stays(what):
    more = handles.added(BOARD, what)
    assert len(more.parts) == len(BOARD.parts) + 1
    assert more.parts[more.receiver] is BOARD.parts[BOARD.receiver]
    new = next(k for k, part in enumerate(more.parts) if all(part is not p for p in BOARD.parts))
    assert handles.removed(more, new) == BOARD


def test_what_cannot_be_is_said_in_a_sentence():
    for wrong in (
        lambda: handles.move(BOARD, "99.end", (0.0, 0.0)),
        lambda: handles.move(BOARD, "0.end", (np.nan, 0.0)),
        lambda: handles.removed(BOARD, BOARD.receiver),
        lambda: handles.removed(BOARD, 99),
        lambda: handles.received_by(BOARD, 99),
        lambda: handles.added(BOARD, "ghost"),
    ):
        with pytest.raises(ValueError, match=r"^[A-Z].*\.$"):
            wrong()


def test_a_scene_becomes_a_board_and_a_scene_again():
    for name in library.scene_names():
        scene = library.named_scene(name)
        again = board_of(scene).scene()
        assert again.names == scene.names
        for a, b in zip(again.groups, scene.groups, strict=True):
            assert all(
                np.array_equal(getattr(a, key), getattr(b, key))
                for key in boards.KINDS[
                    next(k for k, v in boards.KINDS.items() if v[0] is type(a))
                ][1]
            )


def test_bodies_are_what_is_closed_and_rings_that_run_clockwise():
    corners = [(0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0)]

    def ring(points):
        ends = [*points[1:], points[0]]
        return [Part("segment", {"start": a, "end": b}) for a, b in zip(points, ends, strict=True)]

    line = Part("segment", {"start": (2.0, 0.0), "end": (3.0, 0.0)})
    disc = Part("circle", {"center": (5.0, 5.0), "radius": 1.0})
    body = fitted(Board((line, *ring(corners), *ring(corners[::-1]), disc)))
    assert body.bodies().tolist() == [0.0] + [1.0] * 4 + [0.0] * 4 + [1.0]


def test_an_arc_through_three_points_has_its_ends_and_its_middle():
    part = Part("arc", bent((0.0, 0.0), (2.0, 0.0), (1.0, 0.5)))
    np.testing.assert_allclose(
        part.outline(2), [(0.0, 0.0), (1.0, 0.5), (2.0, 0.0)], rtol=0.0, atol=1e-12
    )
    assert part.numbers["sweep"] < 0.0  # a bulge to its left runs clockwise
    np.testing.assert_allclose(part.arc_length(np.array(1.0)), 2.0 * 1.25 * np.arctan2(1.0, 0.75))
