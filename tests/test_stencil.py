"""The four ways to cross a stencil, against NumPy: sums over all its nodes, in double, from the weights as they are."""

import functools

import numpy as np
import pytest
import warp as wp
from scenes_for_tests import ROUND_OFF

from warp_mpm.kernels import stencil as stencils

NODES = (7, 6, 8)  # of the array
COUNT = 40  # stencils
SIZES = [(3, 8), (3, 4), (3, 2), (2, 8), (2, 4), (2, 2)]  # width, lanes
# 27 products of three factors, summed in another order: each rounded once, relative to the sum of their sizes.
SUMMED = 32 * ROUND_OFF

sizes = pytest.mark.parametrize(("width", "lanes"), SIZES)
plain_or_not = pytest.mark.parametrize("plain", [False, True], ids=["vectors", "plain"])  # plain is what a GPU runs


class Case:
    """Random stencils, node values and particle values, on the device and in double."""

    def __init__(self, width, lanes, device):
        random = np.random.default_rng(10 * width + lanes)
        self.width, self.lanes, self.device = width, lanes, device
        self.lowest = random.integers(0, np.array(NODES) - width + 1, (COUNT, 3))
        self.lowest[0], self.lowest[1] = 0, np.array(NODES) - width  # the first and the last there is
        self.weights, self.slopes = random.normal(size=(2, COUNT, 3, width)).astype(np.float32)
        self.nodes = random.normal(size=(*NODES, lanes)).astype(np.float32)
        self.given = random.normal(size=(4, COUNT, lanes)).astype(np.float32)
        self.value_type = stencils.value_type_of(lanes)

    def records(self):
        """The stencils on the device."""
        record = stencils.stencil_type(self.width)
        filled = np.zeros(COUNT, dtype=record.numpy_dtype())
        filled["stride_x"], filled["stride_y"] = NODES[1] * NODES[2], NODES[2]
        filled["first"] = np.ravel_multi_index(tuple(self.lowest.T), NODES)
        for axis, name in enumerate("xyz"):
            filled["w" + name], filled["s" + name] = self.weights[:, axis], self.slopes[:, axis]
        return wp.array(filled, dtype=record, device=self.device)

    def array(self, values):
        """Values (n, lanes) on the device, with a node to spare."""
        rows = np.concatenate([values.reshape(-1, self.lanes), np.zeros((1, self.lanes), dtype=np.float32)])
        return wp.array(rows, dtype=self.value_type, device=self.device)

    def products(self):
        """Products of weights (4, COUNT, width, width, width): plain, with the slope by x, by y, by z."""
        w, s = self.weights.astype(np.float64), self.slopes.astype(np.float64)
        along = [(w, w, w), (s, w, w), (w, s, w), (w, w, s)]
        return np.stack(
            [np.einsum("ni,nj,nk->nijk", x[:, 0], y[:, 1], z[:, 2]) for x, y, z in along],
        )

    def places(self):
        """Index of every stencil's nodes, each (COUNT, width, width, width)."""
        steps = np.indices((self.width,) * 3)
        return tuple(self.lowest[:, axis, None, None, None] + steps[axis] for axis in range(3))

    def gathered(self):
        """Expected sums (4, COUNT, lanes), and those of the sizes."""
        values = self.nodes[self.places()].astype(np.float64)
        sums = np.einsum("anijk,nijkl->anl", self.products(), values)
        return sums, np.einsum("anijk,nijkl->anl", np.abs(self.products()), np.abs(values))

    def scattered(self, kinds):
        """Expected node values after adding the first of the particle values, and the sums of the sizes."""
        sums, sizes = self.nodes.astype(np.float64), np.abs(self.nodes).astype(np.float64)
        for product, given in zip(self.products()[:kinds], self.given, strict=False):
            np.add.at(sums, self.places(), product[..., None] * given[:, None, None, None].astype(np.float64))
            np.add.at(sizes, self.places(), np.abs(product[..., None] * given[:, None, None, None]))
        return sums, sizes


@functools.cache
def gather_kernels(width, lanes, plain):
    """Kernels that gather values, and values with gradients, into rows."""
    record, value_type = stencils.stencil_type(width), stencils.value_type_of(lanes)
    gather = stencils.gather_function(width, lanes, plain)

    @wp.kernel(enable_backward=False, module="unique")
    def values_of(
        given: wp.array(dtype=record), nodes: wp.array(dtype=value_type), results: wp.array(dtype=value_type)
    ):
        n = wp.tid()
        results[n] = gather(given[n], nodes)

    gather_gradient = stencils.gather_gradient_function(width, lanes, plain)

    @wp.kernel(enable_backward=False, module="unique")
    def gradients_of(
        given: wp.array(dtype=record), nodes: wp.array(dtype=value_type), results: wp.array2d(dtype=value_type)
    ):
        n = wp.tid()
        rows = gather_gradient(given[n], nodes)
        for row in range(4):
            results[row, n] = rows[row]

    return values_of, gradients_of


@functools.cache
def scatter_kernels(width, lanes, plain):
    """Kernels that scatter values, and values with gradients."""
    record, value_type = stencils.stencil_type(width), stencils.value_type_of(lanes)
    scatter = stencils.scatter_function(width, lanes, plain)
    scatter_gradient = stencils.scatter_gradient_function(width, lanes, plain)

    @wp.kernel(enable_backward=False, module="unique")
    def values_to(
        given: wp.array(dtype=record), nodes: wp.array(dtype=value_type), values: wp.array2d(dtype=value_type)
    ):
        n = wp.tid()
        scatter(given[n], nodes, values[0, n])

    @wp.kernel(enable_backward=False, module="unique")
    def gradients_to(
        given: wp.array(dtype=record), nodes: wp.array(dtype=value_type), values: wp.array2d(dtype=value_type)
    ):
        n = wp.tid()
        scatter_gradient(given[n], nodes, values[0, n], values[1, n], values[2, n], values[3, n])

    return values_to, gradients_to


@plain_or_not
@sizes
def test_gather_sums_over_the_nodes(width, lanes, plain, device):
    """Sum w x."""
    case = Case(width, lanes, device)
    results = wp.zeros(COUNT, dtype=case.value_type, device=device)
    kernel, _ = gather_kernels(width, lanes, plain)
    wp.launch(kernel, COUNT, inputs=[case.records(), case.array(case.nodes), results], device=device)
    sums, sizes = case.gathered()
    assert np.all(np.abs(results.numpy() - sums[0]) <= SUMMED * sizes[0])


@plain_or_not
@sizes
def test_gather_with_gradients(width, lanes, plain, device):
    """Sum w x, and with the slopes along one axis in the place of its weights."""
    case = Case(width, lanes, device)
    results = wp.zeros((4, COUNT), dtype=case.value_type, device=device)
    _, kernel = gather_kernels(width, lanes, plain)
    wp.launch(kernel, COUNT, inputs=[case.records(), case.array(case.nodes), results], device=device)
    sums, sizes = case.gathered()
    assert np.all(np.abs(results.numpy() - sums) <= SUMMED * sizes)


@pytest.mark.parametrize("kinds", [1, 4], ids=["values", "gradients"])
@plain_or_not
@sizes
def test_scatter_adds_to_the_nodes(width, lanes, kinds, plain, device):
    """X + w a, and with gradients + dw/dx b + dw/dy c + dw/dz d; nodes of no stencil keep every bit.

    Up to COUNT stencils add to a node, one after the other: their roundings are relative to what is there by then.
    """
    case = Case(width, lanes, device)
    nodes = case.array(case.nodes)
    kernel = scatter_kernels(width, lanes, plain)[kinds > 1]
    values = wp.array(case.given, dtype=case.value_type, device=device)
    wp.launch(kernel, COUNT, inputs=[case.records(), nodes, values], device=device)
    sums, sizes = case.scattered(kinds)
    after = nodes.numpy()[:-1].reshape(case.nodes.shape)
    assert np.all(np.abs(after - sums) <= SUMMED * sizes)
    touched = np.zeros(NODES, dtype=bool)
    touched[case.places()] = True
    assert not touched.all()
    np.testing.assert_array_equal(after[~touched], case.nodes[~touched])
