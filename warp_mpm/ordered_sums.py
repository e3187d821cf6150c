"""The scatter as sums in a fixed order: the same bits on every run on a GPU (see `kernels/bins.py`)."""

import warp as wp

from warp_mpm.kernels import ordered_sums
from warp_mpm.kernels.bins import Bins, fill_bins, mark_bins
from warp_mpm.kernels.blocks import NODES
from warp_mpm.kernels.precision import scalar
from warp_mpm.launch import Launcher, Task
from warp_mpm.state import State


class OrderedSums:
    """Keeps the particles in bins, and sums what they give to the nodes."""

    def __init__(self, state: State, launcher: Launcher) -> None:
        self.state = state
        self.launcher = launcher
        model, count = state.model, state.count
        self.bins = Bins()
        # Twice the count: the sort uses the second half as its scratch.
        self.bins.bin = wp.zeros(2 * count, dtype=int, device=model.device)
        self.bins.particle = wp.zeros(2 * count, dtype=int, device=model.device)
        self.bins.first = wp.zeros(len(state.grid.start), dtype=int, device=model.device)
        self.bins.charge = state.charge
        widths = [charge.half_width for charge in model.charges]
        self.bins.half_width = wp.array(widths, dtype=scalar, device=model.device)
        self.bins.count = count
        # Bits that tell all bins, and `NOWHERE` with all its bits set, from each other: sorting fewer takes less time.
        self._bits = len(state.grid.start).bit_length()

    def fill(self) -> None:
        """Put the particles into bins: after each step, and where they lie otherwise in memory."""
        state, device = self.state, self.state.device
        inputs = [state.particles, state.grid, state.clock, self.bins]
        wp.launch(fill_bins, state.count, inputs=inputs, device=device)
        wp.utils.radix_sort_pairs(self.bins.bin, self.bins.particle, state.count, 0, self._bits)
        wp.launch(mark_bins, state.count, inputs=[self.bins], device=device)

    def scatter(self, momentum: bool, force: bool) -> list[Task]:
        """Tasks that do what the scatter does, once the bins are filled."""
        model = self.state.model
        return self._tasks(
            ordered_sums.ordered_scatter_kernel(model.shape, momentum, force, model.affine, model.damped)
        )

    def reprojection(self) -> list[Task]:
        """Tasks that sum the re-projected momentum, in the bins of the step before."""
        model = self.state.model
        return self._tasks(ordered_sums.ordered_reprojection_kernel(model.shape, model.affine))

    def _tasks(self, kernel: wp.Kernel) -> list[Task]:
        """A kernel over the nodes of all blocks, piece by piece."""
        state = self.state
        inputs = [state.particles, state.grid, state.clock, self.bins, state.model.ambient_pressure]
        return [[self.launcher.record(kernel, count * NODES, [*inputs, begin])] for _, begin, count in state.pieces()]
