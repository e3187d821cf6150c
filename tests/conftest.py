"""What all tests share."""

import pytest
import warp as wp

from warp_mpm.warp_startup import start_quietly

start_quietly()
pytest.register_assert_rewrite("usd_checks")  # so that its assertions, too, say what they found


@pytest.fixture(params=[device.alias for device in wp.get_devices()])
def device(request):
    """Name of each device of this machine in turn: the CPU, and every GPU there is."""
    return request.param
