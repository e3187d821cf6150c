"""Threads of a user's program: they may start Warp, and ask for runs, at the same time."""

import os
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from time import sleep

import numpy as np
from scenes_for_tests import block, inert_gas

from warp_mpm.config import Save
from warp_mpm.progress import Silent
from warp_mpm.simulation import simulate

# Starts Warp in three threads, with as many changes between them as can be, and says where standard error goes then.
STARTS = """
import os, sys, threading
from warp_mpm.warp_startup import start_quietly

sys.setswitchinterval(1e-6)
ready = threading.Barrier(3)

def start():
    ready.wait()
    start_quietly()

threads = [threading.Thread(target=start) for _ in range(3)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
os.write(2, b"heard")
"""


class Turns(Silent):
    """Notes how many runs are under way at a time."""

    def __init__(self):
        self.under_way = set()
        self.most = 0

    def update(self, time, end_time, step, note):
        """A run of this thread is under way."""
        self.under_way.add(threading.get_ident())
        self.most = max(self.most, len(self.under_way))
        sleep(0.01)  # so that another one gets the time to begin

    def close(self):
        """It has ended."""
        self.under_way.discard(threading.get_ident())


def test_runs_of_two_threads_take_turns():
    scene = block((4, 4, 4), material=inert_gas(), end_time=2e-4)
    turns, both_ready = Turns(), threading.Barrier(2)

    def run(_):
        both_ready.wait()
        return simulate(scene, save=Save(frames=2), device="cpu", threads=1, progress=turns).record

    with ThreadPoolExecutor(2) as threads:
        records = list(threads.map(run, range(2)))
    assert turns.most == 1
    np.testing.assert_array_equal(records[0].field_pressure, records[1].field_pressure)


def test_threads_that_start_warp_leave_standard_error_as_it_was():
    ended = subprocess.run([sys.executable, "-c", STARTS], env=os.environ, capture_output=True, timeout=60, check=False)
    assert (ended.returncode, ended.stderr) == (0, b"heard")
