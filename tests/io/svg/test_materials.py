"""Albedos of colours: the luminance of sRGB numbers, which are taken for linear."""

import pytest

from firstorder.io.svg._materials import albedo_of

RED, GREEN, BLUE = 0.2126, 0.7152, 0.0722


@pytest.mark.parametrize(
    ("paint", "albedo"),
    [
        ("#f00", RED),
        ("#00ff00", GREEN),
        (" #0000FF ", BLUE),
        ("#336699", 0.2 * RED + 0.4 * GREEN + 0.6 * BLUE),
        ("rgb(51, 102, 153)", 0.2 * RED + 0.4 * GREEN + 0.6 * BLUE),
        ("rgba(0%, 100%, 0%, 0.5)", GREEN),
        ("rgb(20% 40% 60% / 50%)", 0.2 * RED + 0.4 * GREEN + 0.6 * BLUE),
        ("rgb(25.5 20% 300)", 0.1 * RED + 0.2 * GREEN + BLUE),
        ("rgb(-3, 0, 110%)", BLUE),
        ("hsl(240deg, 100%, 50%)", BLUE),
        ("hsla(-240 100 50 / 0.1)", GREEN),
        ("hsl(30, 100%, 50%)", RED + 0.5 * GREEN),
        ("hsl(0, 50%, 40%)", 0.6 * RED + 0.2 * (GREEN + BLUE)),  # 0.4 (1 + 0.5) and 0.4 (1 - 0.5)
        ("hsl(100, 120%, 150%)", 1.0),
        ("White", 1.0),
        ("black", 0.0),
        ("#000", 0.0),
        ("currentColor", 0.0),
        ("context-fill", 0.0),
    ],
)
def test_the_albedo_of_a_colour_is_its_luminance(paint, albedo):
    assert albedo_of(paint) == pytest.approx(albedo, rel=1e-12)


@pytest.mark.parametrize("paint", ["none", "", " Transparent "])
def test_no_paint_has_no_albedo(paint):
    assert albedo_of(paint) is None


def test_a_gradient_has_no_albedo_unless_nobody_asks():
    assert albedo_of("url(#g)", strict=False) == 0.0
    with pytest.raises(ValueError, match="a gradient or a pattern has no albedo"):
        albedo_of("url(#g)")


@pytest.mark.parametrize(
    "paint",
    [
        "blurple",
        "#12",
        "rgb(1, 2)",
        "rgb(1 2 3 4 5)",
        "hsl(1 x 2)",
        "#00g",
        "rgb(1, 2, 3" + " " * 199 + ")",
    ],
)
def test_what_is_no_colour_is_told_in_its_first_forty_letters(paint):
    with pytest.raises(ValueError, match="is not a colour") as caught:
        albedo_of(paint)
    assert str(caught.value) == f"{paint[:40]!r} is not a colour."


@pytest.mark.parametrize("strict", [True, False])
def test_a_word_as_long_as_may_be_is_asked_for_and_a_longer_one_is_not(monkeypatch, strict):
    import svgelements

    asked = []
    monkeypatch.setattr(svgelements, "Color", asked.append)
    for count in (200, 201):
        with pytest.raises(ValueError, match="is not a colour"):
            albedo_of("x" * count, strict)
    assert asked == ["x" * 200]
