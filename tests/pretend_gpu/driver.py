"""What Warp asks of its native library about a GPU, answered without one.

The methods of `Driver` have the names and arguments of Warp's native functions, whose prototypes are in `warp.h`.
"""

import ctypes
from collections.abc import Callable
from typing import Any

import numpy as np
from warp._src import context

from pretend_gpu.memory import CAPACITY, DeviceMemory

CONTEXT = 1
ARCHITECTURE = 90
CURRENT_STREAM = 0xFFFFFFFFFFFFFFFF
MOST_ARGUMENTS = 64
ACCESSES = ["", "reads", "writes", "adds to", "raises"]
SEVERAL = 0xFFFFFFFF  # threads
CONFLICT, FOREIGN, MISALIGNED = 1, 2, 3

CONSTANTS = {
    "wp_cuda_driver_is_initialized": 1,
    "wp_cuda_driver_version": 13000,
    "wp_cuda_device_get_count": 1,
    "wp_cuda_device_get_name": b"pretend GPU",
    "wp_cuda_device_get_arch": ARCHITECTURE,
    "wp_cuda_device_get_sm_count": 132,
    "wp_cuda_device_get_max_shared_memory": 232448,
    "wp_cuda_device_is_uva": 1,
    "wp_cuda_device_get_pageable_memory_access": 0,
    "wp_cuda_device_get_direct_managed_mem_access_from_host": 0,
    "wp_cuda_device_get_host_native_atomic_supported": 0,
    "wp_cuda_device_get_managed_memory_supported": 1,
    "wp_cuda_device_get_concurrent_managed_access_supported": 1,
    "wp_cuda_device_is_mempool_supported": 1,
    "wp_cuda_device_is_ipc_supported": 0,
    "wp_cuda_device_get_uuid": None,
    "wp_cuda_device_get_pci_domain_id": 0,
    "wp_cuda_device_get_pci_bus_id": 0,
    "wp_cuda_device_get_pci_device_id": 0,
    "wp_cuda_device_get_primary_context": CONTEXT,
    "wp_cuda_context_get_current": CONTEXT,
    "wp_cuda_context_set_current": None,
    "wp_cuda_context_push_current": None,
    "wp_cuda_context_pop_current": None,
    "wp_cuda_context_check": 0,
    "wp_cuda_context_is_primary": 1,
    "wp_cuda_context_get_device_ordinal": 0,
    "wp_cuda_stream_destroy": None,
    "wp_cuda_stream_register": None,
    "wp_cuda_stream_unregister": None,
    "wp_cuda_context_synchronize": 1,
    "wp_cuda_stream_synchronize": 1,
    "wp_cuda_stream_wait_event": None,
    "wp_cuda_stream_wait_stream": None,
    "wp_cuda_event_destroy": None,
    "wp_cuda_event_record": None,
    "wp_cuda_event_synchronize": 1,
    "wp_cuda_unload_module": None,
    "wp_cuda_configure_kernel_shared_memory": 1,
    "wp_cuda_graph_exec_destroy": 1,
}


class Fault(ctypes.Structure):
    """The first that a launch did wrong; as in `threads.h`."""

    _fields_ = [(name, ctypes.c_uint) for name in ("kind", "access", "other_access", "thread", "other_thread", "pad")]
    _fields_ += [("address", ctypes.c_ulonglong)]


class Device(ctypes.Structure):
    """What a launch is told; as in `threads.h`."""

    _fields_ = [
        ("memory", ctypes.c_ulonglong),
        ("size", ctypes.c_ulonglong),
        ("words", ctypes.c_void_p),
        ("fault", Fault),
        ("launch", ctypes.c_uint),
    ]


class Kernel:
    """A compiled kernel."""

    def __init__(self, module: bytes, name: str) -> None:
        llvm = context.runtime.llvm
        self.name = name
        find = {end: llvm.wp_lookup(module, f"{name}_{end}".encode()) for end in ("sizes", "launch")}
        sizes = (ctypes.c_ulonglong * MOST_ARGUMENTS)()
        count = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p)(find["sizes"])(sizes)
        self.sizes = sizes[:count]
        unsigned = [ctypes.c_uint] * 3
        self.launch = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 3, *unsigned)(find["launch"])


class Driver:
    """A GPU that does everything at once and in no particular order of threads.

    Raises:
        RuntimeError: a kernel, or what the host does while a graph is captured, would go wrong on a GPU.
    """

    def __init__(self, native: Any) -> None:
        self.native = native
        self.memory = DeviceMemory()
        self.device = Device(self.memory.begin, CAPACITY, self.memory.words)
        self.order = np.random.default_rng(0)
        self.stream = 0
        self.captured: dict[int, list[Callable[[], None]]] = {}  # by stream
        self._known: dict[int, Any] = {}  # modules, kernels and graphs by their handles

    def _handle(self, of: Any = None) -> int:
        handle = CONTEXT + 1 + len(self._known)
        self._known[handle] = of
        return handle

    def _issue(self, work: Callable[[], object], stream: Any = CURRENT_STREAM) -> None:
        """Do something now, or when the graph that is being captured is launched."""
        at = address(stream)
        at = self.stream if at == CURRENT_STREAM else at
        if at in self.captured:
            self.captured[at].append(work)
            return
        self._forbid_in_capture("work on another stream")
        with self.memory:
            work()

    def _forbid_in_capture(self, what: str) -> None:
        if self.captured:
            raise RuntimeError(f"pretend GPU: {what} while a graph is captured")

    def wp_cuda_device_get_memory_info(self, ordinal: int, free: Any, total: Any) -> None:
        for place, value in ((free, CAPACITY - self.memory.used), (total, CAPACITY)):
            if place is not None:
                place._obj.value = value

    # Streams and events, which everything has reached as soon as it is issued

    def wp_cuda_stream_create(self, context: Any, priority: int) -> int:
        return self._handle()

    def wp_cuda_event_create(self, context: Any, flags: int) -> int:
        return self._handle()

    def wp_cuda_context_set_stream(self, context: Any, stream: Any, synchronise: int) -> None:
        self.stream = address(stream)

    def wp_cuda_stream_is_capturing(self, stream: Any) -> bool:
        return address(stream) in self.captured

    def wp_cuda_stream_get_capture_id(self, stream: Any) -> int:
        return address(stream)

    # Memory

    def wp_alloc_device_default(self, context: Any, size: int, *_: Any) -> int | None:
        return self.memory.allocate(size)

    def wp_free_device_default(self, context: Any, at: Any, *_: Any) -> None:
        self.memory.release(address(at))

    wp_alloc_device = wp_alloc_device_async = wp_alloc_device_default
    wp_free_device = wp_free_device_async = wp_free_device_default

    def wp_memcpy_h2d(self, context: Any, to: Any, source: Any, size: int, stream: Any) -> bool:
        self._forbid_in_capture("a copy from or to the host")
        return self.wp_memcpy_d2d(context, to, source, size, stream)

    wp_memcpy_d2h = wp_memcpy_h2d

    def wp_memcpy_d2d(self, context: Any, to: Any, source: Any, size: int, stream: Any) -> bool:
        ends = address(to), address(source)
        self._issue(lambda: ctypes.memmove(*ends, size), stream)
        return True

    def wp_memset_device(self, context: Any, to: Any, value: int, size: int, stream: Any) -> bool:
        begin = address(to)
        self._issue(lambda: ctypes.memset(begin, value, size), stream)
        return True

    def wp_memtile_device(self, context: Any, to: Any, source: Any, size: int, times: int) -> bool:
        begin, values = address(to), ctypes.string_at(address(source), size) * times
        self._issue(lambda: ctypes.memmove(begin, values, len(values)))
        return True

    # Algorithms, by those for the host

    def wp_radix_sort_pairs_int_device(self, *arguments: Any) -> None:
        self._issue(lambda: self.native.wp_radix_sort_pairs_int_host(*arguments))

    def wp_radix_sort_pairs_int64_device(self, *arguments: Any) -> None:
        self._issue(lambda: self.native.wp_radix_sort_pairs_int64_host(*arguments))

    def wp_array_scan_int_device(self, *arguments: Any) -> bool:
        self._issue(lambda: self.native.wp_array_scan_int_host(*arguments))
        return True

    # Kernels

    def wp_cuda_load_module(self, context_of: Any, path: bytes) -> int:
        handle = self._handle()
        name = self._known[handle] = f"pretend_gpu_{handle}".encode()
        if context.runtime.llvm.wp_load_obj(path, name, False) != 0:
            raise RuntimeError(f"pretend GPU: cannot load {path.decode()}")
        return handle

    def wp_cuda_get_kernel(self, context: Any, module: Any, name: bytes) -> int:
        return self._handle(Kernel(self._known[address(module)], name.decode()))

    def wp_cuda_launch_kernel(self, _context: Any, kernel: Any, size: int, *rest: Any) -> int:
        _most_blocks, block_size, _stride, _cluster, _shared, arguments, stream, _recorded = rest
        known: Kernel = self._known[address(kernel)]
        copies = [ctypes.string_at(address(at), bytes) for at, bytes in zip(arguments, known.sizes, strict=True)]
        self._issue(lambda: self._run(known, copies, -(-size // block_size), block_size), stream)
        return 0

    def _run(self, kernel: Kernel, arguments: list[bytes], blocks: int, block_size: int) -> None:
        pointers = (ctypes.c_char_p * len(arguments))(*arguments)
        order = self.order.permutation(blocks).astype(np.uint32)
        first = int(self.order.integers(block_size))
        self.device.launch += 1
        self.device.fault = Fault()
        kernel.launch(ctypes.byref(self.device), pointers, order.ctypes.data, blocks, block_size, first)
        if self.device.fault.kind:
            raise RuntimeError(f"pretend GPU: {kernel.name}: {self._described(self.device.fault)}")

    def _described(self, fault: Fault) -> str:
        access = ACCESSES[fault.access]
        where = self.memory.whose(fault.address)
        if fault.kind == FOREIGN:
            return f"thread {fault.thread - 1} {access} memory that is in no array of the device"
        if fault.kind == MISALIGNED:
            return f"thread {fault.thread - 1} uses an address that is not aligned, at {where}"
        other = (
            f"thread {fault.other_thread - 1}" if 0 < fault.other_thread < CURRENT_STREAM >> 32 else "another thread"
        )
        return f"thread {fault.thread - 1} {access} what {other} {ACCESSES[fault.other_access]}, {where}"

    # Graphs

    def wp_cuda_graph_begin_capture(self, context: Any, stream: Any, external: int, mode: int) -> bool:
        self.captured[address(stream)] = []
        return True

    def wp_cuda_graph_end_capture(self, context: Any, stream: Any, graph: Any) -> bool:
        graph._obj.value = self._handle(self.captured.pop(address(stream)))
        return True

    def wp_cuda_graph_create_exec(self, context: Any, stream: Any, graph: Any, executable: Any) -> bool:
        executable._obj.value = address(graph)
        return True

    def wp_cuda_graph_launch(self, graph: Any, stream: Any) -> bool:
        self._forbid_in_capture("the launch of a graph")
        with self.memory:
            for work in self._known[address(graph)]:
                work()
        return True

    def wp_cuda_graph_destroy(self, context: Any, graph: Any) -> bool:
        self._known[address(graph)] = None
        return True


def address(of: Any) -> int:
    """The number in whatever Warp passes as a pointer or a handle."""
    if of is None or isinstance(of, int):
        return of or 0
    if isinstance(of, ctypes._Pointer):
        return ctypes.addressof(of.contents)
    if isinstance(of, ctypes.c_void_p):
        return of.value or 0
    return ctypes.addressof(getattr(of, "_obj", of))
