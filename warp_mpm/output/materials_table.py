"""The table of `warp-mpm materials`: stated and implied detonation speed and pressure of each, and where it is from."""

from collections.abc import Mapping

from rich import box
from rich.console import Console
from rich.table import Table

from warp_mpm.materials import Material

GIGAPASCAL = 1e9  # [Pa]
HEADINGS = ("name", "law", "rho0", "D", "implied", "p_CJ", "implied", "from")
UNITS = ("", "", "kg/m3", "m/s", "m/s", "GPa", "GPa", "")
NUMBERS = slice(2, 7)  # columns that are numbers


def print_materials(materials: Mapping[str, Material], console: Console | None = None) -> None:
    """Print one line for each material: a table on a terminal, else columns with the citation last.

    Args:
        materials: by name.
        console: where to; standard output if not given.
    """
    console = console or Console()
    rows = [_row(name, material) for name, material in materials.items()]
    if console.is_terminal:
        console.print(_table(rows))
        return
    lines = [HEADINGS, UNITS, *rows]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    numbers = range(*NUMBERS.indices(len(widths)))
    for line in lines:
        cells = (
            f"{cell:>{width}}" if column in numbers else f"{cell:{width}}"
            for column, (cell, width) in enumerate(zip(line, widths, strict=True))
        )
        console.print("  ".join(cells).rstrip(), markup=False, highlight=False, soft_wrap=True)


def _table(rows: list[tuple[str, ...]]) -> Table:
    """The rows as a table."""
    table = Table(box=box.SIMPLE_HEAD)
    for column, (heading, unit) in enumerate(zip(HEADINGS, UNITS, strict=True)):
        number = column in range(*NUMBERS.indices(len(HEADINGS)))
        title = f"{heading}\n{unit}" if unit else heading
        table.add_column(title, justify="right" if number else "left", no_wrap=heading != "from")
    for row in rows:
        table.add_row(*row)
    return table


def _row(name: str, material: Material) -> tuple[str, ...]:
    """A material in words; what it does not have stays empty."""

    def shown(value: float | None, unit: float, digits: int) -> str:
        return "" if value is None else f"{value / unit:.{digits}f}"

    implied = material.cj
    return (
        name,
        type(material.equation_of_state).__name__,
        f"{material.density:g}",
        shown(material.stated_speed, 1.0, 0),
        shown(implied.detonation_speed if implied else None, 1.0, 0),
        shown(material.stated_pressure, GIGAPASCAL, 2),
        shown(implied.pressure if implied else None, GIGAPASCAL, 2),
        material.citation,
    )
