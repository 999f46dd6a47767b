import pathlib
import re

import numpy as np
import pytest

README = pathlib.Path(__file__).parents[1] / "README.md"


EXAMPLES = re.findall(r"```python\n(.*?)```", README.read_text(), re.DOTALL)


def printed(example, capsys):
    """The lines that an example prints."""
    exec(compile(example, "README.md", "exec"), {})
    return capsys.readouterr().out.splitlines()


@pytest.mark.smoke
def test_the_example_is_short_and_prints_what_it_says(capsys):
    reflection = EXAMPLES[0]
    assert len(reflection.splitlines()) <= 12
    numbers = [line for line in printed(reflection, capsys) if not line.isalpha()]
    ours, closed = (
        np.concatenate([np.ravel(eval(line)) for line in part])
        for part in (numbers[0::2], numbers[1::2])
    )
    assert ours.shape == (7,)
    np.testing.assert_allclose(ours, closed, rtol=1e-12)


@pytest.mark.smoke
def test_the_shadow_of_the_example_is_that_of_a_disc(capsys):
    (line,) = printed(EXAMPLES[1], capsys)

    def closed(x, radius):
        """The lamp's two parts beside the disc, towards +x."""
        sine = lambda px, py: (px - x) / np.hypot(px - x, py)  # noqa: E731
        middle = np.arctan2(0.1 - x, 0.5)
        half = np.arcsin(radius / np.hypot(0.1 - x, 0.5))
        low, high = sine(-0.5, 1.0), sine(0.5, 1.0)
        return (high - low) - (np.sin(middle + half) - np.sin(middle - half))

    h, x, r = 1e-4, 0.3, 0.1
    expected = [
        closed(x, r),
        (closed(x + h, r) - closed(x - h, r)) / (2.0 * h),
        (closed(x, r + h) - closed(x, r - h)) / (2.0 * h),
        (closed(x + h, r) - 2.0 * closed(x, r) + closed(x - h, r)) / h**2,
    ]
    np.testing.assert_allclose([float(v) for v in line.split()], expected, atol=2e-6)


def test_the_other_examples_run(capsys):
    for example in EXAMPLES[2:]:
        printed(example, capsys)
