// What a CUDA kernel needs to run on a CPU, thread after thread, and a look at everything it touches.
//
// Warp's own compiler puts a call before each access to memory (-fsanitize=thread; the functions are below) and before
// each access through a pointer that may not be aligned (-fsanitize=alignment). Threads of one launch that touch the
// same word must all read it, or all add to it atomically, or all raise it atomically and perhaps read it; writing the
// value that is there already is no conflict either. Numbers of less than four bytes are not watched.

#include "builtin.h"
#include "deterministic.h"

#define PLAIN __attribute__((disable_sanitizer_instrumentation, no_sanitize("alignment")))

namespace pretend_gpu {

enum Access : unsigned { READ = 1, WRITE, ADD, RAISE };
enum Kind { CONFLICT = 1, FOREIGN, MISALIGNED };

struct Word {  // of device memory: who touched it last, and in which launch; no launch, and it is of no array
    unsigned launch, thread, access;  // or SEVERAL threads, all of which add, or raise
    unsigned readers;  // the thread that has read it in this launch, or SEVERAL
};
struct Fault {
    unsigned kind, access, other_access, thread, other_thread, padding;
    unsigned long long address;
};
struct Device {
    unsigned long long memory, size;
    Word* words;
    Fault fault;  // the first
    unsigned launch;
};
static const unsigned NOBODY = 0, SEVERAL = 0xFFFFFFFF;
static const int MOST_DOUBTS = 4096;
// Volatile, for the calls that read and write them are put in after the compiler has optimised what is around them.
static Device* volatile device;
static volatile unsigned thread, atomic_access;
static volatile unsigned long long stack;
// Writes where another thread has written: conflicts if they change the word.
static unsigned* volatile doubted[MOST_DOUBTS];
static volatile unsigned value_before[MOST_DOUBTS];
static volatile int doubt_count;

PLAIN static void blame(unsigned kind, unsigned access, unsigned other_access, unsigned other, unsigned long long at)
{
    if (!device->fault.kind)
        device->fault = { kind, access, other_access, thread, other, 0, at };
}

PLAIN static bool excused(unsigned access, unsigned other)
{
    if (access == other)
        return access != WRITE;
    return (access == READ && other == RAISE) || (access == RAISE && other == READ);
}

PLAIN static void touch_word(unsigned access, unsigned long long offset)
{
    Word& word = device->words[offset / 4];
    unsigned* place = (unsigned*)(device->memory + offset / 4 * 4);
    if (word.launch != device->launch)
        word = { device->launch, NOBODY, 0, NOBODY };
    const bool touched = word.thread != NOBODY && word.thread != thread;
    if (touched && access == WRITE && word.access == WRITE && doubt_count < MOST_DOUBTS) {
        doubted[doubt_count] = place;
        value_before[doubt_count] = *place;
        doubt_count = doubt_count + 1;
    } else if (touched && !excused(access, word.access))
        blame(CONFLICT, access, word.access, word.thread, (unsigned long long)place);
    if (access == READ) {
        word.readers = word.readers == NOBODY || word.readers == thread ? thread : SEVERAL;
        return;
    }
    if (word.readers != NOBODY && word.readers != thread && !excused(access, READ))
        blame(CONFLICT, access, READ, word.readers, (unsigned long long)place);
    const bool written_before = word.thread == thread && word.access == WRITE;
    word.thread = touched && access != WRITE && access == word.access ? SEVERAL : thread;
    word.access = written_before ? WRITE : access;
}

PLAIN static bool near(const void* one, const void* other, unsigned long long bytes)
{
    return (unsigned long long)one - (unsigned long long)other + bytes < 2 * bytes;
}

PLAIN static void touch(void* at, unsigned long long bytes, unsigned access)
{
    const unsigned long long offset = (unsigned long long)at - device->memory;
    if (offset >= device->size) {
        const bool own = near(at, (void*)stack, 1 << 20);  // a thread's own variables are on the stack
        if (!own && !near(at, (const void*)&device, 1 << 20))  // and those of this file near that one
            blame(FOREIGN, access, 0, 0, (unsigned long long)at);
        return;
    }
    if (!device->words[offset / 4].launch || !device->words[(offset + bytes - 1) / 4].launch)
        blame(FOREIGN, access, 0, 0, (unsigned long long)at);
    if (bytes < 4)
        return;
    for (unsigned long long n = 0; n < bytes; n += 4)
        touch_word(atomic_access ? atomic_access : access, offset + n);
}

PLAIN static void end_thread()
{
    for (int n = 0; n < doubt_count; ++n)
        if (*doubted[n] != value_before[n])
            blame(CONFLICT, WRITE, WRITE, 0, (unsigned long long)doubted[n]);
    doubt_count = 0;
}

struct Atomic {  // what happens while it exists happens at once
    PLAIN Atomic(unsigned access) { atomic_access = access; }
    PLAIN ~Atomic() { atomic_access = 0; }
};

}  // namespace pretend_gpu

extern "C" {
PLAIN void __tsan_init() { }
PLAIN void __tsan_func_entry(void*) { }
PLAIN void __tsan_func_exit() { }
#define WATCH(bytes)                                                                                                   \
    PLAIN void __tsan_read##bytes(void* at) { pretend_gpu::touch(at, bytes, pretend_gpu::READ); }                      \
    PLAIN void __tsan_write##bytes(void* at) { pretend_gpu::touch(at, bytes, pretend_gpu::WRITE); }                    \
    PLAIN void __tsan_unaligned_read##bytes(void* at) { pretend_gpu::touch(at, bytes, pretend_gpu::READ); }            \
    PLAIN void __tsan_unaligned_write##bytes(void* at) { pretend_gpu::touch(at, bytes, pretend_gpu::WRITE); }
WATCH(1)
WATCH(2)
WATCH(4)
WATCH(8)
WATCH(16)
PLAIN void __tsan_read_range(void* at, unsigned long bytes) { pretend_gpu::touch(at, bytes, pretend_gpu::READ); }
PLAIN void __tsan_write_range(void* at, unsigned long bytes) { pretend_gpu::touch(at, bytes, pretend_gpu::WRITE); }
PLAIN void* __tsan_memcpy(void* to, const void* from, unsigned long bytes)
{
    pretend_gpu::touch((void*)from, bytes, pretend_gpu::READ);
    pretend_gpu::touch(to, bytes, pretend_gpu::WRITE);
    return memcpy(to, from, bytes);
}
PLAIN void* __tsan_memmove(void* to, const void* from, unsigned long bytes) { return __tsan_memcpy(to, from, bytes); }
PLAIN void* __tsan_memset(void* to, int value, unsigned long bytes)
{
    pretend_gpu::touch(to, bytes, pretend_gpu::WRITE);
    return memset(to, value, bytes);
}
PLAIN void __ubsan_handle_type_mismatch_v1(void*, unsigned long at)
{
    pretend_gpu::blame(pretend_gpu::MISALIGNED, 0, 0, 0, at);
}
}

// CUDA's names. From here on, native snippets are those of a GPU.
#define __CUDACC__
#define __CUDA_ARCH__ PRETEND_GPU_ARCHITECTURE
#define __global__
#define __launch_bounds__(...)
#define __cluster_dims__(...)

struct Dimensions {
    unsigned x, y, z;
};
static Dimensions blockIdx, threadIdx, blockDim, gridDim;
struct alignas(8) float2 {
    float x, y;
};
struct alignas(16) double2 {
    double x, y;
};

namespace pretend_gpu {

PLAIN static void begin_launch(Device* of, unsigned block_count, unsigned block_size)
{
    device = of;
    stack = (unsigned long long)__builtin_frame_address(0);
    gridDim = { block_count, 1, 1 };
    blockDim = { block_size, 1, 1 };
}

PLAIN static void begin_thread(unsigned block, unsigned number)
{
    blockIdx = { block, 0, 0 };
    threadIdx = { number, 0, 0 };
    thread = block * blockDim.x + number + 1;
}

}  // namespace pretend_gpu

namespace wp {
template <class... Arguments> static auto atomically_add(Arguments&&... arguments)
{
    pretend_gpu::Atomic now(pretend_gpu::ADD);
    return atomic_add(arguments...);
}
template <class... Arguments> static auto atomically_max(Arguments&&... arguments)
{
    pretend_gpu::Atomic now(pretend_gpu::RAISE);
    return atomic_max(arguments...);
}
template <class... Arguments> static auto atomically_min(Arguments&&... arguments)
{
    pretend_gpu::Atomic now(pretend_gpu::RAISE);
    return atomic_min(arguments...);
}
}  // namespace wp

// `red.global.add.v2` and `.v4`: several numbers at once.
template <int count> struct alignas(4 * count) Several {
    float values[count];
};
template <class... Numbers> static void add_several(float* at, Numbers... numbers)
{
    pretend_gpu::Atomic now(pretend_gpu::ADD);
    const float values[] = { numbers... };
    auto* several = (Several<sizeof...(numbers)>*)at;
    for (int n = 0; n < int(sizeof...(numbers)); ++n)
        several->values[n] += values[n];
}
