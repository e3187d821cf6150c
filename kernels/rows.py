"""A row of a stencil's nodes, along z, as C++ sees it: in a few chunks, which the loops of `stencil.py` go through.

Both kinds declare the same: types `lanes`, a node's value, and T<c>, chunk c; `load<c>` from a row; `begin<c>` and
`end<c>` around the addition to a row; `repeat<c>`, a chunk whose nodes all have one value; `mul` and `plus`, a sum
plus a weighted chunk; `as_lanes`, a node's value from one of Warp's.
"""

from warp_mpm.kernels.precision import REAL
from warp_mpm.kernels.wide_access import wide_access


def warp_type(lanes: int) -> str:
    """Warp's own type of as many values, in C++."""
    return f"wp::vec_t<{lanes}, {REAL}>"


class Nodes:
    """Node by node, in vectors of Warp's; additions are atomic. This is what a GPU runs."""

    unrolled = "#pragma unroll"  # else the weights lie in memory

    def __init__(self, lanes: int, width: int) -> None:
        self.lanes, self.width = lanes, width

    def each(self, line: str) -> str:
        """A line for every chunk, its number in the place of @."""
        return "\n".join(line.replace("@", str(node)) for node in range(self.width))

    def declarations(self) -> str:
        """What the module's docstring lists."""
        return f"""
    typedef {warp_type(self.lanes)} lanes;
    auto mul = [](lanes x, {REAL} weight) {{ return wp::mul(x, weight); }};
    auto plus = [](lanes sum, lanes x, {REAL} weight) {{ return wp::add(sum, wp::mul(x, weight)); }};
    auto as_lanes = [](lanes x) {{ return x; }};
{wide_access(self.lanes)}
""" + self.each("""
    typedef lanes T@;
    auto load@ = [&](const lanes* row) { return read(row + @); };
    auto begin@ = [](const lanes*) { return lanes{}; };
    auto end@ = [&](lanes* row, lanes x) { add_to(row + @, x); };
    auto repeat@ = [](lanes x) { return x; };
""")

    def weights(self, name: str, values: str) -> str:
        """Declare `name<c>`, the weights of each chunk's nodes, from an array of those of all."""
        return self.each(f"    {REAL} {name}@ = {values}[@];")

    def total(self, name: str, weight: str) -> str:
        """The weighted sum of the nodes in the chunks `name<c>`, an expression."""
        products = [f"wp::mul({name}{node}, {weight}{node})" for node in range(self.width)]
        total = products[0]
        for product in products[1:]:
            total = f"wp::add({total}, {product})"
        return total


class Vectors:
    """In vectors of the compiler's, of up to `widest` numbers, which a CPU takes at a time.

    The last chunk may reach one node farther than the row. What is there has no weight, and is written back as it was:
    still short of what another thread may write to (see `warp_mpm/model.py`), and arrays have a node to spare.
    """

    unrolled = ""  # as the compiler likes

    def __init__(self, lanes: int, width: int, widest: int) -> None:
        self.lanes, self.width, self.numbers = lanes, width, lanes * width
        self.chunks: list[range] = []  # of a row's numbers
        begin = 0
        while begin < self.numbers:
            size = min(widest, 1 << (self.numbers - begin - 1).bit_length())
            self.chunks.append(range(begin, begin + size))
            begin += size

    def each(self, line: str) -> str:
        """A line for every chunk, its number in the place of @."""
        return "\n".join(line.replace("@", str(chunk)) for chunk in range(len(self.chunks)))

    def declarations(self) -> str:
        """What the module's docstring lists."""
        shared = f"""
    typedef {self._vector("lanes", self.lanes)};
    auto mul = [](auto x, auto weight) {{ return x * weight; }};
    auto plus = [](auto sum, auto x, auto weight) {{ return __builtin_elementwise_fma(x, (decltype(x))weight, sum); }};
    auto as_lanes = [](const {warp_type(self.lanes)}& x) {{ lanes y; memcpy(&y, &x, sizeof(y)); return y; }};
"""
        return shared + "\n".join(self._chunk(c, numbers) for c, numbers in enumerate(self.chunks))

    def weights(self, name: str, values: str) -> str:
        """Declare `name<c>`, the weights of each chunk's numbers, from an array of those of all nodes."""
        lines = []
        for chunk, numbers in enumerate(self.chunks):
            given = (f"{values}[{n // self.lanes}]" if n < self.numbers else "0" for n in numbers)
            lines.append(f"    T{chunk} {name}{chunk} = {{{', '.join(given)}}};")
        return "\n".join(lines)

    def total(self, name: str, weight: str) -> str:
        """The weighted sum of the nodes in the chunks `name<c>`, an expression."""
        products = self.each(f"auto t@ = {name}@ * {weight}@;")
        nodes = []
        for chunk, numbers in enumerate(self.chunks):
            for first in range(0, min(numbers.stop, self.numbers) - numbers.start, self.lanes):
                places = ", ".join(str(first + lane) for lane in range(self.lanes))
                nodes.append(f"__builtin_shufflevector(t{chunk}, t{chunk}, {places})")
        return f"[&]() {{ {products} return (lanes)({' + '.join(nodes)}); }}()"

    def _chunk(self, chunk: int, numbers: range) -> str:
        """The declarations of one chunk."""
        places = ", ".join(str(n % self.lanes) for n in numbers)
        at = f"({REAL}*)row + {numbers.start}"
        return f"""
    typedef {self._vector(f"T{chunk}", len(numbers))};
    auto load{chunk} = [](const void* row) {{ T{chunk} x; __builtin_memcpy(&x, {at}, sizeof(x)); return x; }};
    auto begin{chunk} = load{chunk};
    auto end{chunk} = [](void* row, T{chunk} x) {{ __builtin_memcpy({at}, &x, sizeof(x)); }};
    auto repeat{chunk} = [](lanes x) {{ return __builtin_shufflevector(x, x, {places}); }};
"""

    @staticmethod
    def _vector(name: str, size: int) -> str:
        return f"{REAL} {name} __attribute__((ext_vector_type({size})))"


Row = Nodes | Vectors
