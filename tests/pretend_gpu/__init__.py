"""A GPU played by the CPU, for machines that have none: `WARP_MPM_PRETEND_GPU=1 pytest -k cuda:0`.

Warp believes that there is a device `cuda:0`. It generates CUDA source for it, records graphs and copies memory, all as
for a real one; below that, the source is compiled for the CPU and its threads run one after the other, blocks in random
order. What would go wrong on a GPU is an error, or crashes:

- two threads of a launch that touch the same memory, unless both read it, add to it atomically, or raise it;
- an address that is not aligned as the hardware needs it, or that is in no array of the device;
- a host that reads the device's memory, and anything that reads memory after it was freed (a segmentation fault);
- a copy from or to the host while a graph is captured;
- numbers that nobody wrote, which are NaN, and answers that depend on the order of threads.

What it cannot tell is how fast a GPU is, whether NVIDIA's compiler accepts the source (`test_cuda_compiles.py` does),
and whether copies and kernels overlap as they should: it has one stream, on which everything is done at once. Warp's
own functions are those for the CPU, and rounding is the CPU's. A thread that reads and then writes a number counts as
one that writes it, and numbers of less than four bytes are not watched. It needs Linux.
"""

import hashlib
import os
import sys
from functools import partial
from pathlib import Path
from typing import Any

import warp as wp

HERE = Path(__file__).parent
CACHE = HERE.parents[1] / "build" / "pretend_gpu"
NEED_NO_GPU = ("wp_cuda_toolkit_version", "wp_cuda_compile_program")
VARIABLE = "WARP_MPM_PRETEND_GPU"


def wanted() -> bool:
    """Whether the environment asks for it."""
    return os.environ.get(VARIABLE, "") not in ("", "0")


def install() -> None:
    """Make Warp find it; before Warp starts.

    Raises:
        OSError: this is not Linux.
    """
    if sys.platform != "linux":
        raise OSError(f"{VARIABLE}: expected Linux, got {sys.platform}; unset it")
    from warp._src import build, context

    from pretend_gpu.driver import CONSTANTS, Driver
    from pretend_gpu.translation import compile_for_cpu

    class Native:
        """Warp's native library, with some of its functions replaced."""

        def __init__(self, library: Any) -> None:
            self.library = library
            self.driver = Driver(library)

        def __getattr__(self, name: str) -> Any:
            function = getattr(self.driver, name, None)
            if function is None and name in CONSTANTS:
                function = partial(_constant, CONSTANTS[name])
            elif function is None and _needs_a_gpu(name):
                function = partial(_unknown, name)
            elif function is None:
                return getattr(self.library, name)
            found = self.__dict__[name] = partial(function)  # an object of its own, for Warp sets attributes of it
            return found

    wp.config.kernel_cache_dir = str(CACHE / _version())
    load, compile_for_gpu = context.Runtime.load_dll, build.build_cuda

    def load_native(runtime: Any, path: str) -> Any:
        library = load(runtime, path)
        return Native(library) if Path(path).name.startswith("warp.") else library

    def compile(path: str, architecture: int, output: str, **options: Any) -> None:
        if Path(output).is_relative_to(wp.config.kernel_cache_dir):
            compile_for_cpu(Path(path).read_text(), output, architecture)
        else:  # for its own sake, not to be run
            compile_for_gpu(path, architecture, output, **options)

    context.Runtime.load_dll, build.build_cuda = load_native, compile


def _version() -> str:
    """Of what compiles kernels: those of another version are not used again."""
    sources = [(HERE / name).read_bytes() for name in ("threads.h", "translation.py")]
    return hashlib.sha256(b"".join(sources)).hexdigest()[:8]


def _needs_a_gpu(name: str) -> bool:
    return (name.startswith("wp_cuda_") and name not in NEED_NO_GPU) or name.endswith("_device")


def _constant(value: Any, *_: Any) -> Any:
    return value


def _unknown(name: str, *arguments: Any) -> None:
    raise RuntimeError(f"pretend GPU: no answer to Warp's {name}; add one to tests/pretend_gpu/driver.py")
