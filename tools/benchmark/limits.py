"""What this machine can do: memory bandwidth and multiply-add rate, through the solver's own launcher.

Bandwidth: a_i += s b_i over arrays far larger than any cache, two numbers read and one written each. In place, as the
solver works, so that all bytes counted do move: a store to a third array would first load what it overwrites, on some
machines. Rate: chains of x = m x + c that stay in registers, enough of them to fill the pipelines; a multiply-add of
one number counts as one operation. Both are loops in C++ over clang's vector types on a CPU, like the solver's own.
"""

import itertools
from collections.abc import Callable, Sequence

import warp as wp

from benchmark.timing import Progress, interleaved, spread, timed
from warp_mpm.launch import SMALLEST_SHARED_WORK, Launcher, Task

STREAM_CHUNK = 1024  # vectors of four that a CPU thread of a launch streams over
REGISTERS = 128  # numbers in the chains of one thread of a launch, as many at a time as fill the pipelines
CPU_PASSES = 8_000_000  # multiply-adds in each chain: some 10 ms
GPU_PASSES = 2_000
GPU_THREADS = 2**18


@wp.func_native("""
#if defined(__clang__) && !defined(__CUDACC__)
    typedef float lanes __attribute__((ext_vector_type(16)));
    float* x = (float*)(a.data + (size_t)first);
    const float* y = (const float*)(b.data + (size_t)first);
    for (size_t i = 0; i < 4 * (size_t)count; i += 16) {
        lanes p, q;
        __builtin_memcpy(&p, x + i, sizeof(lanes));
        __builtin_memcpy(&q, y + i, sizeof(lanes));
        p = __builtin_elementwise_fma(q, (lanes)factor, p);
        __builtin_memcpy(x + i, &p, sizeof(lanes));
    }
#else
    for (int i = 0; i < count; ++i)
        a.data[first + i] = wp::add(a.data[first + i], wp::mul(b.data[first + i], factor));
#endif
""")
def add_multiple(a: wp.array(dtype=wp.vec4), b: wp.array(dtype=wp.vec4), factor: float, first: int, count: int):
    """A += factor b, for `count` vectors; a multiple of four of them on a CPU."""
    ...


@wp.kernel(enable_backward=False, module="unique")
def stream(a: wp.array(dtype=wp.vec4), b: wp.array(dtype=wp.vec4), chunk: int, begin: int):
    """A += b / 2, from vector `begin` on."""
    add_multiple(a, b, 0.5, begin + wp.tid() * chunk, chunk)


@wp.func_native("""
#if defined(__clang__) && !defined(__CUDACC__)
#if defined(__AVX512F__)
    typedef float lanes __attribute__((ext_vector_type(16)));
#elif defined(__AVX__)
    typedef float lanes __attribute__((ext_vector_type(8)));
#else
    typedef float lanes __attribute__((ext_vector_type(4)));
#endif
    auto chain = [](lanes x) { return __builtin_elementwise_fma(x, (lanes)0.999f, (lanes)0.001f); };
    float total = 0.0f;
    for (int part = 0; part < 128 / (8 * (int)(sizeof(lanes) / sizeof(float))); ++part) {
        lanes a = (lanes)(seed + part), b = a + 1.0f, c = a + 2.0f, d = a + 3.0f;
        lanes e = a + 4.0f, f = a + 5.0f, g = a + 6.0f, h = a + 7.0f;
        for (int n = 0; n < passes; ++n) {
            a = chain(a); b = chain(b); c = chain(c); d = chain(d);
            e = chain(e); f = chain(f); g = chain(g); h = chain(h);
        }
        lanes sum = ((a + b) + (c + d)) + ((e + f) + (g + h));
        for (int lane = 0; lane < (int)(sizeof(lanes) / sizeof(float)); ++lane) total += sum[lane];
    }
    return total;
#else
    float total = 0.0f;
    for (int part = 0; part < 16; ++part) {
        float x[8];
        for (int i = 0; i < 8; ++i) x[i] = seed + part + i;
        for (int n = 0; n < passes; ++n)
            for (int i = 0; i < 8; ++i) x[i] = x[i] * 0.999f + 0.001f;
        for (int i = 0; i < 8; ++i) total += x[i];
    }
    return total;
#endif
""")
def run_chains(seed: float, passes: int) -> float:
    """REGISTERS chains of `passes` multiply-adds each, and a sum of them so that none can be left out."""
    ...


@wp.kernel(enable_backward=False, module="unique")
def multiply_add(results: wp.array(dtype=float), passes: int, begin: int):
    """Chains of multiply-adds, on each thread."""
    results[begin + wp.tid()] = run_chains(float(wp.tid()), passes)


def measure_limits(
    device: wp.Device, threads: Sequence[int], stream_bytes: int, rounds: int, progress: Progress
) -> list[dict[str, float]]:
    """Memory bandwidth and multiply-add rate, for each number of threads.

    Args:
        device: where.
        threads: numbers of threads.
        stream_bytes: size of each of the two arrays that are streamed; far above the caches.
        rounds: measurements of each, interleaved; the medians count.
        progress: told what is going on.

    Returns:
        A record for each number of threads: `memory_bandwidth_bytes_per_s` and `multiply_adds_per_s`, and the lowest
        and highest of each.
    """
    progress(f"limits: two arrays of {stream_bytes / 2**20:.0f} MiB, and chains of multiply-adds, {rounds} rounds")
    launchers = {count: Launcher(device, count) for count in threads}
    vectors = max(1, stream_bytes // (16 * STREAM_CHUNK)) * STREAM_CHUNK
    a = wp.zeros(vectors, dtype=wp.vec4, device=device)
    b = wp.full(vectors, wp.vec4(1.0, 1.0, 1.0, 1.0), dtype=wp.vec4, device=device)
    works: dict[tuple[str, int], Callable[[], float]] = {}
    for count, launcher in launchers.items():
        works["stream", count] = _work(launcher, _stream_tasks(launcher, a, b))
        works["chains", count] = _work(launcher, _chain_tasks(launcher))
    interleaved(works, 1)  # threads start, code is loaded
    seconds = interleaved(works, rounds)
    for launcher in launchers.values():
        launcher.close()
    moved = 3 * 16 * vectors
    return [
        {
            "threads": count,
            **spread("memory_bandwidth_bytes_per_s", [moved / s for s in seconds["stream", count]]),
            **spread("multiply_adds_per_s", [_multiply_adds(launcher) / s for s in seconds["chains", count]]),
        }
        for count, launcher in launchers.items()
    ]


def _work(launcher: Launcher, tasks: list[Task]) -> Callable[[], float]:
    """What times some tasks; they count as work that is worth all threads."""
    return lambda: timed(launcher.device, lambda: launcher.run(tasks, SMALLEST_SHARED_WORK))


def _stream_tasks(launcher: Launcher, a: wp.array, b: wp.array) -> list[Task]:
    chunk = 1 if launcher.device.is_cuda else STREAM_CHUNK  # neighbouring threads of a GPU take neighbouring vectors
    edges = [len(a) // chunk * slot // launcher.threads for slot in range(launcher.threads + 1)]
    return [
        [launcher.record(stream, end - begin, [a, b, chunk, begin * chunk])] for begin, end in itertools.pairwise(edges)
    ]


def _chain_tasks(launcher: Launcher) -> list[Task]:
    threads, passes = _chain_threads(launcher), _chain_passes(launcher)
    results = wp.zeros(launcher.threads * threads, dtype=float, device=launcher.device)
    return [
        [launcher.record(multiply_add, threads, [results, passes, slot * threads])] for slot in range(launcher.threads)
    ]


def _multiply_adds(launcher: Launcher) -> int:
    return REGISTERS * launcher.threads * _chain_threads(launcher) * _chain_passes(launcher)


def _chain_threads(launcher: Launcher) -> int:
    return GPU_THREADS if launcher.device.is_cuda else 1


def _chain_passes(launcher: Launcher) -> int:
    return GPU_PASSES if launcher.device.is_cuda else CPU_PASSES
