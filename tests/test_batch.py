"""Batches of particles: as one by one to the bit, and in a CPU's vector units."""

import platform
import re

import numpy as np
import pytest
import warp as wp
from scenes_for_tests import CELL, OPEN, ROUND_OFF, advance, block, inert_gas, start
from test_equations_of_state import eos_classes

import warp_mpm as mpm
from warp_mpm.config import Order, Transfer
from warp_mpm.kernels import material, shape
from warp_mpm.kernels.batch import BATCH, get_function, numbers_in, put_function
from warp_mpm.kernels.burn.compression import CompressionBurn
from warp_mpm.kernels.burn.programmed import ProgrammedBurn
from warp_mpm.kernels.burn.programmed_compression import ProgrammedCompressionBurn
from warp_mpm.kernels.eos.ideal_gas import IdealGas
from warp_mpm.kernels.eos.mie_gruneisen import MieGruneisen
from warp_mpm.kernels.exponential import exponential
from warp_mpm.kernels.precision import PRECISION, scalar
from warp_mpm.kernels.response import Response, response_of
from warp_mpm.kernels.strain import Strain
from warp_mpm.kernels.strained import Strained, strained_of

NUMBER = wp.dtype_to_numpy(scalar)
MATHEMATICS = "exp|exp2|exp10|expm1|log|log2|log10|log1p|pow|a?sinh?|a?cosh?|a?tanh?|atan2|cbrt|hypot|fmod|remainder"
CALLS = rf"\0_?((?:{MATHEMATICS})f?)\0".encode()  # names in an object file
BURNS = (None, ProgrammedBurn, CompressionBurn, ProgrammedCompressionBurn)
SOLID = mpm.MieGruneisen(1630.0, 2390.0, 2.05, 0.9)


def through_a_batch(record, record_of):
    """Kernel that takes every particle's record to a batch and back."""
    put, get = put_function(record), get_function(record)

    @wp.kernel(enable_backward=False, module="unique")
    def carry(given: wp.array(dtype=record), returned: wp.array(dtype=record)):
        batch = wp.zeros(shape=wp.static(BATCH * numbers_in(record)), dtype=scalar)
        for i in range(BATCH):
            put(batch, i, given[i])
        for i in range(BATCH):
            returned[i] = record_of(get(batch, i))

    return carry


@pytest.mark.parametrize(("record", "record_of"), [(Strained, strained_of), (Response, response_of)])
def test_what_goes_into_a_batch_comes_out_of_it(record, record_of):
    """Every number of every particle in its field."""
    numbers = np.random.default_rng(3).random((BATCH, numbers_in(record))).astype(NUMBER)
    given = wp.array(numbers.view(record.numpy_dtype()).ravel(), dtype=record, device="cpu")
    returned = wp.zeros(BATCH, dtype=record, device="cpu")
    wp.launch(through_a_batch(record, record_of), 1, inputs=[given, returned], device="cpu")
    assert returned.numpy().tobytes() == numbers.tobytes()


def impact():
    """Explosive with an unreacted state, struck and lit, next to water."""
    builder = mpm.SceneBuilder("impact")
    builder.domain((0.0, 0.0, 0.0), (24 * CELL, 5 * CELL, 5 * CELL), cells=(24, 5, 5))
    tnt = mpm.find_material("tnt", burn=mpm.Burn.BOTH, unreacted=SOLID)
    builder.charge(mpm.Box((0.0, 0.0, 0.0), (12 * CELL, 5 * CELL, 5 * CELL)), tnt, name="tnt")
    builder.charge(
        mpm.Box((12 * CELL, 0.0, 0.0), (24 * CELL, 5 * CELL, 5 * CELL)),
        mpm.find_material("water"),
        velocity=(-200.0, 0.0, 0.0),
        name="water",
    )
    builder.detonator(mpm.PointDetonator((0.0, 0.0, 0.0)))
    builder.end_time(1.0)
    return builder.build()


SCENES = {
    "leaves through open faces": (lambda: block((9, 7, 5), walls=OPEN, margin_cells=1), {}),
    "nothing burns": (lambda: block((6, 6, 6), material=inert_gas(), walls=OPEN, ambient_pressure=1e4), {}),
    "no damping": (lambda: block((9, 7, 5), margin_cells=1), {"transfer": Transfer.FLIP}),
    "strain at the start of a step": (
        lambda: block((9, 7, 5), margin_cells=1),
        {"order": Order.USF, "transfer": Transfer.FLIP},
    ),
    "unreacted state, water": (impact, {}),
}


@pytest.mark.parametrize("case", SCENES)
def test_a_batch_answers_as_its_particles_do_one_by_one(case):
    """To the bit, and with the same tallies; the groups of particles are no whole numbers of batches."""
    scene, config = SCENES[case]
    ends = []
    for batched in (True, False):
        solver = start(scene(), **config)
        assert solver.batched
        solver.batched = batched
        solver.sort()
        advance(solver, 60)
        counts = solver.state.ranges[..., 1]
        assert (counts[counts > 0] % BATCH).any()
        state, particles = solver.state, solver.state.particles
        ends.append([particles.position, particles.motion, particles.matter, state.tallies, state.maxima])
    for together, alone in zip(*ends, strict=True):
        for name in together.numpy().dtype.names or [...]:  # of a record, which has bytes between its fields
            assert together.numpy()[name].tobytes() == alone.numpy()[name].tobytes()
    if case == "leaves through open faces":
        assert (ends[0][1].numpy()["mass"] == 0.0).any()


COMBINATIONS = [(eos, burn, None) for eos in sorted(eos_classes(), key=str) for burn in BURNS[:2]]
COMBINATIONS += [(IdealGas, burn, MieGruneisen) for burn in BURNS[2:]]


@pytest.mark.skipif(PRECISION != "single", reason="the library's exponential is a call")
@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="tried for these processors only")
@pytest.mark.parametrize(("eos", "burn", "unreacted"), COMBINATIONS)
def test_answers_are_computed_in_vectors(eos, burn, unreacted, tmp_path, capfd):
    """The compiler is asked whether it did it; and nothing is called, which would be done number by number."""
    kernel = material.update_kernel(shape.BSPLINE, Strain.REPROJECTED, True, True, eos, burn, unreacted, batched=True)
    flags = f"{wp.config.cpu_compiler_flags or ''} -Rpass=loop-vectorize"
    before = kernel.module.options.get("cpu_compiler_flags")
    kernel.module.options["cpu_compiler_flags"] = flags
    try:
        wp.compile_aot_module(kernel.module, device="cpu", module_dir=str(tmp_path))
    finally:
        kernel.module.options["cpu_compiler_flags"] = before
    said = capfd.readouterr().err
    (source,) = tmp_path.glob("*.cpp")
    (loop,) = [n for n, line in enumerate(source.read_text().splitlines(), 1) if "while n < size" in line]
    lines = [int(n) for n in re.findall(r"\.cpp:(\d+):\d+: remark: vectorized loop", said)]
    assert any(loop <= n < loop + 5 for n in lines), said
    (compiled,) = tmp_path.glob("*.o")
    assert re.findall(CALLS, compiled.read_bytes()) == []


def test_the_exponential():
    """Against NumPy's in double: cut off by 5e-9, and half a dozen roundings, of which the last sum's count most."""

    @wp.kernel(enable_backward=False, module="unique")
    def evaluate(given: wp.array(dtype=scalar), values: wp.array(dtype=scalar)):
        values[wp.tid()] = exponential(given[wp.tid()])

    given = np.concatenate([np.linspace(-86.0, 86.0, 100_001), [0.0, -1e-30, 0.5 * np.log(2.0)]]).astype(np.float32)
    values = wp.zeros(len(given), dtype=scalar, device="cpu")
    wp.launch(evaluate, len(given), inputs=[wp.array(given, dtype=scalar, device="cpu"), values], device="cpu")
    exact = np.exp(given.astype(np.float64))
    error = np.abs(values.numpy() / exact - 1.0)
    assert error.max() < 3 * ROUND_OFF, f"{error.max() / ROUND_OFF:.2f} roundings, at {given[error.argmax()]:.3f}"
