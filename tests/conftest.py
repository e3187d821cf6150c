"""What all tests share."""

import pretend_gpu
import pytest
import warp as wp
from hypothesis import HealthCheck, Phase, settings

from warp_mpm.warp_startup import start_quietly

if pretend_gpu.wanted():
    pretend_gpu.install()
start_quietly()
pytest.register_assert_rewrite("usd_checks")  # so that its assertions, too, say what they found

# What hypothesis tries: the same few cases every time, or thousands of others with --hypothesis-profile=thorough.
# Cases that fail are not made smaller: each is a run, and that takes minutes.
QUICK = settings(
    max_examples=100,
    phases=[Phase.generate],
    deadline=None,
    derandomize=True,
    database=None,
    suppress_health_check=list(HealthCheck),
)
settings.register_profile("quick", QUICK)
settings.register_profile("thorough", QUICK, max_examples=5000, derandomize=False)
settings.load_profile("quick")


@pytest.fixture(params=[device.alias for device in wp.get_devices()])
def device(request):
    """Name of each device of this machine in turn: the CPU, and every GPU there is."""
    return request.param
