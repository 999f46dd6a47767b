import jax
import pytest
from hypothesis import HealthCheck, settings

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


@pytest.fixture
def key():
    """The one seed of every test that draws random numbers."""
    return jax.random.key(0)
