"""Events that a user writes in at most five lines each: sound, and every fault seen."""

import pytest
import sympy

from firstorder.checks import check
from firstorder.checks.own_events import (
    RULES,
    FaultVerdict,
    Report,
    Square,
    _case_of,
    _check_event,
    _judged,
    _with_rules,
)
from firstorder.conventions import FLATLAND_SLOPE
from firstorder.symbolic import event, lobe
from firstorder.transport import Reflection, Travel

x, theta, v, f, n, s, d, t, a, w = sympy.symbols("x theta v f n sigma d t a w")
SATIN = sympy.cos(t) ** 8 * (1 + a * t**2)
EVENTS = {
    "thin lens": (lambda: event({theta: theta - x / f}, parameters={f: 0.5}), 5),
    "haze": (
        lambda: event(factor=sympy.exp(-s * d / sympy.cos(theta)), parameters={s: 0.3, d: 2.0}),
        3,
    ),
    "satin": (lambda: Reflection(lobe(SATIN, t, parameters={a: 0.3})), 5),
    "flat interface": (
        lambda: event({theta: sympy.asin(sympy.sin(theta) / n)}, parameters={n: 1.5}),
        3,
    ),
    "moving blocker": (
        lambda: event(
            factor=1 / (1 + sympy.exp((x - v * d - w) / s)), parameters={d: 0.7, w: 0.1, s: 0.2}
        ),
        3,
    ),
    "step aside": (lambda: event({x: x + 30}), 5),
    "loupe": (lambda: event({theta: theta - x / f}, parameters={f: 0.01}), 3),
    "motion": (lambda: event({x: x + w * t}, parameters={w: 1.3}), 5),  # over (x, t)
}


@pytest.mark.parametrize("name", EVENTS)
def test_an_event_of_ones_own_is_judged_as_the_librarys_are(name):
    make, ruled = EVENTS[name]
    report = check(make(), name=name)
    assert report.sound, str(report)
    held = [q for q in report.squares if q.verdict != "refused"]
    assert len(held) == ruled, str(report)
    assert {q.portrait for q in held} == {fault.portrait for fault in report.faults}
    assert len(report.faults) >= 2 * ruled
    assert report.seconds < 60.0


def test_the_librarys_own_events_are_judged_too():
    report = check(Travel(0.7), FLATLAND_SLOPE)
    assert report.sound, str(report)
    assert [q.verdict for q in report.squares] == ["equal"] * 4
    assert "4 of" not in str(report)
    assert str(report).startswith("Travel: sound")


def test_a_report_says_what_was_not_seen():
    square = Square("lens", "gradient", "equal", 1e-16)
    fault = FaultVerdict("off by 0.1 %", "gradient", False)
    report = Report("lens", (square,), (fault,), 1.0)
    assert not report.sound
    assert "not seen: off by 0.1 %, gradient" in str(report)


@pytest.mark.parametrize(("focal", "verdict"), [(0.2, "unequal"), (0.01, "refused")])
def test_a_wrong_rule_is_seen_where_the_grid_is_fine_enough_to_tell(focal, verdict):
    lens = event({theta: theta - x / f}, parameters={f: focal})
    wrong = _with_rules(lens, RULES["spectrum"]["off by 0.1 %"])
    assert _judged(_case_of(wrong), "spectrum").verdict == verdict


def test_light_that_an_event_sends_away_is_one_sentence():
    with pytest.raises(ValueError, match="`event` must leave light whose ends are found"):
        check(event({x: 1000 * x + 10**9}))


def test_a_plain_function_is_no_event():
    with pytest.raises(TypeError, match=r"must be an event, but is a function: `symbolic.event`"):
        _check_event(lambda x: x**2)


def test_an_event_that_takes_no_light_is_refused():
    y = sympy.Symbol("y")
    with pytest.raises(ValueError, match="takes no light of flatland"):
        check(event({y: 2 * y}))
