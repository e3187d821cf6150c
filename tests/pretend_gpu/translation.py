"""CUDA source, as Warp generates it, compiled for the CPU by the compiler that Warp brings."""

import re
from pathlib import Path

from warp._src import build, context

HERE = Path(__file__).parent
# Vectors made of several numbers would not be watched: the sanitizer knows accesses of up to 16 bytes.
FLAGS = "-fsanitize=thread -fsanitize=alignment -fsanitize-recover=alignment -fno-vectorize -fno-slp-vectorize"

INCLUDE = '#include "builtin.h"'
TILES = ("wp::tile_shared_storage_t tile_mem;", "wp::tile_shared_storage_t::init();")
KERNEL = re.compile(r'extern "C" [^;{]*?__global__ void\s+(?:WP_MAXNREG\(\d+\)\s*)?(\w+)\(\s*(.*?)\)\s*\{', re.DOTALL)
ATOMIC = re.compile(r"\bwp::atomic_(add|max|min)\(")
# `asm volatile("red...v4.f32 [%0], {...};" ::"l"(address), "f"(value), ... : "memory")`
SEVERAL_ADDED = re.compile(
    r'asm volatile\("red\.relaxed\.gpu\.global\.add\.v\d\.f32[^"]*"\s*'
    r'::"l"\(__cvta_generic_to_global\((.*?)\)\), ("f".*?) : "memory"\);',
    re.DOTALL,
)
VALUE = re.compile(r'"f"\((\w+\[\d+\])\)')

LAUNCH = """
extern "C" PLAIN int {name}_sizes(unsigned long long* sizes)
{{
    const unsigned long long all[] = {{ {sizes} }};
    for (int n = 0; n < {count}; ++n)
        sizes[n] = all[n];
    return {count};
}}

extern "C" PLAIN void {name}_launch(
    pretend_gpu::Device* device, void** arguments, const unsigned* blocks, unsigned block_count, unsigned block_size,
    unsigned first
)
{{
    pretend_gpu::begin_launch(device, block_count, block_size);
    for (unsigned block = 0; block < block_count; ++block) {{
        for (unsigned n = 0; n < block_size; ++n) {{
            pretend_gpu::begin_thread(blocks[block], (first + 37 * n) % block_size);
            {name}({values});
            pretend_gpu::end_thread();
        }}
    }}
}}
"""


def compile_for_cpu(source: str, output: str, architecture: int) -> None:
    """Compile a module's CUDA source into an object for the CPU."""
    path = Path(output).with_suffix(".cpp")
    path.write_text(translated(source))
    flags = f"{FLAGS} -DPRETEND_GPU_ARCHITECTURE={10 * architecture}"
    header = context.runtime.get_clang_pch_dir()  # compiled once, which halves the time
    include = (str(HERE),)
    build.build_cpu(
        output, str(path), extra_flags=flags, extra_include_dirs=include, use_precompiled_headers=True, pch_dir=header
    )


def translated(source: str) -> str:
    """C++ with a function NAME_launch for each kernel, and NAME_sizes, which tells its arguments' sizes [bytes].

    Raises:
        ValueError: there is something in the source that this cannot translate.
    """
    if source.count(INCLUDE) != 1:
        raise ValueError(f"pretend GPU: expected one {INCLUDE} in what Warp generates")
    source = source.replace(INCLUDE, '#include "threads.h"')
    for tiles in TILES:  # which are not used, and take long to make for each thread
        source = source.replace(tiles, "")
    source = SEVERAL_ADDED.sub(lambda found: f"add_several({found[1]}, {', '.join(VALUE.findall(found[2]))});", source)
    source = ATOMIC.sub(r"wp::atomically_\1(", source)
    kernels = KERNEL.findall(source)
    if "asm volatile" in source.partition("threads.h")[2].replace('asm volatile(".pragma', "") or not kernels:
        raise ValueError("pretend GPU: unknown instructions, or no kernel, in what Warp generates")
    return source + "".join(_launch(*kernel) for kernel in kernels)


def _launch(name: str, arguments: str) -> str:
    types = [argument.rsplit(maxsplit=1)[0] for argument in _parted(arguments)]
    values = ", ".join(f"*({kind}*)arguments[{n}]" for n, kind in enumerate(types))
    sizes = ", ".join(f"sizeof({kind})" for kind in types)
    return LAUNCH.format(name=name, values=values, sizes=sizes, count=len(types))


def _parted(arguments: str) -> list[str]:
    """The parts between commas that are not within a template's brackets."""
    parts, depth = [""], 0
    for character in arguments:
        depth += {"<": 1, ">": -1}.get(character, 0)
        if character == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += character
    return [part.strip() for part in parts]
