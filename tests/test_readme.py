import pathlib
import re

import numpy as np
import pytest

README = pathlib.Path(__file__).parents[1] / "README.md"


@pytest.mark.smoke
def test_the_example_is_short_and_prints_what_it_says(capsys):
    (code,) = re.findall(r"```python\n(.*?)```", README.read_text(), re.DOTALL)
    assert len(code.splitlines()) <= 12
    exec(compile(code, "README.md", "exec"), {})
    numbers = [line for line in capsys.readouterr().out.splitlines() if not line.isalpha()]
    ours, closed = (
        np.concatenate([np.ravel(eval(line)) for line in part])
        for part in (numbers[0::2], numbers[1::2])
    )
    assert ours.shape == (7,)
    np.testing.assert_allclose(ours, closed, rtol=1e-12)
