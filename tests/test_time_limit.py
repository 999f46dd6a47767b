"""`--minutes` leaves out what would begin too late, the slow tests first, and says how many."""

import os
import subprocess
import sys

TESTS = """
import time, pytest

@pytest.mark.slow
def test_slow(): pass

def test_long(): time.sleep(0.4)

def test_last(): pass
"""


def printed(folder, *options):
    (folder / "test_three.py").write_text(TESTS)
    command = [sys.executable, "-m", "pytest", "-v", "-c", "/dev/null", "--rootdir", str(folder)]
    ran = subprocess.run(
        [*command, "-p", "tests.time_limit", *options, str(folder)],
        env=os.environ | {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    return ran.returncode, ran.stdout


def test_all_tests_run_in_their_order_where_no_limit_is_given(tmp_path):
    code, text = printed(tmp_path)
    assert code == 0
    assert text.index("test_slow PASSED") < text.index("test_long PASSED")
    assert "left out" not in text


def test_what_is_slow_comes_last_and_all_run_within_a_long_time(tmp_path):
    _, text = printed(tmp_path, "--minutes", "60")
    assert text.index("test_last PASSED") < text.index("test_slow PASSED")
    assert "tests left out after 60 minutes: 0" in text


def test_what_would_begin_too_late_is_left_out_and_counted(tmp_path):
    code, text = printed(tmp_path, "--minutes", "0")
    assert code == 0
    assert "PASSED" not in text
    assert "tests left out after 0 minutes: 3" in text
