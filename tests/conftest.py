import contextlib
import weakref

import jax
import pytest
from hypothesis import HealthCheck, settings

from firstorder.numerics._compiled import own_programs

# The first example of a test compiles and the others do not: no deadline is fair to both. The same
# examples on every run, so that a red test is red for everybody.
settings.register_profile(
    "firstorder",
    deadline=None,
    derandomize=True,
    max_examples=25,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("firstorder")

# A test in single precision says `with jax.enable_x64(False)`, which older JAX has elsewhere.
if not hasattr(jax, "enable_x64"):
    import jax.experimental

    jax.enable_x64 = jax.experimental.enable_x64


@pytest.fixture(autouse=True, scope="session")
def _twins_have_their_own_programs():
    """A wrong twin put in the place of a part is compiled with, and forgotten with the patch."""
    right = pytest.MonkeyPatch.setattr, pytest.MonkeyPatch.undo
    open_programs = weakref.WeakKeyDictionary()

    def put(patch, *args, **kwargs):
        stack = open_programs.setdefault(patch, contextlib.ExitStack())
        stack.enter_context(own_programs())
        return right[0](patch, *args, **kwargs)

    def undo(patch):
        right[1](patch)
        open_programs.pop(patch, contextlib.ExitStack()).close()

    pytest.MonkeyPatch.setattr, pytest.MonkeyPatch.undo = put, undo
    yield
    pytest.MonkeyPatch.setattr, pytest.MonkeyPatch.undo = right


@pytest.fixture
def key():
    """The one seed of every test that draws random numbers."""
    return jax.random.key(0)
