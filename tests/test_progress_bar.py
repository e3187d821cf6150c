"""Progress of a run: a bar on a terminal, lines elsewhere."""

import io

import pytest
from rich.console import Console
from scenes_for_tests import block

import warp_mpm as mpm
from warp_mpm.output import progress_bar
from warp_mpm.output.progress_bar import progress_on


def run_with(progress, steps=1000):
    progress.message("compiling [all] kernels")
    for step in range(steps + 1):
        progress.update(step * 1e-4 / steps, 1e-4, step, "2.61 GPa")
    progress.close()


def test_lines_where_there_is_no_terminal():
    console = Console(file=io.StringIO(), width=40)
    run_with(progress_on(console))
    lines = console.file.getvalue().splitlines()
    assert lines[0] == "compiling [all] kernels"
    assert [line.split()[0] for line in lines[1:]] == [f"{tenth}0%" if tenth else "0%" for tenth in range(11)]
    assert "50.0 of 100.0 us  step 500  2.61 GPa  " in lines[6]
    assert lines[6].endswith(" s left")


def test_a_bar_on_a_terminal():
    console = Console(file=io.StringIO(), width=100, force_terminal=True)
    run_with(progress_on(console))
    text = console.file.getvalue()
    assert "compiling [all] kernels" in text
    assert "100%" in text
    assert "100.0 of 100.0 us  step 1000  2.61 GPa" in text


def test_a_script_sees_what_the_command_shows(capsys):
    """The run closes its progress, whatever way it ends: a bar would hide the cursor of the terminal for good."""
    console = Console(file=io.StringIO(), width=100, force_terminal=True)
    result = mpm.simulate(block((4, 3, 3), end_time=2e-6), device="cpu", progress=mpm.progress_on(console))
    assert console.file.getvalue().endswith("\x1b[?25h")  # shows the cursor
    mpm.simulate(block((4, 3, 3), end_time=2e-6), device="cpu", progress=mpm.progress_on())
    mpm.print_summary(result.summary)
    shown = capsys.readouterr().out
    assert "block: 288 particles in 36 cells on CPU" in shown
    assert "100%  2.0 of 2.0 us" in shown
    assert "peak pressure" in shown


@pytest.mark.parametrize("terminal", [True, False])
def test_closing_before_the_first_update_and_twice(terminal):
    progress = progress_on(Console(file=io.StringIO(), force_terminal=terminal))
    progress.close()
    progress.close()


@pytest.mark.parametrize("terminal", [True, False])
def test_one_run_after_the_other(terminal):
    """The second one of a study shows as much as the first, with a time left of its own."""
    console = Console(file=io.StringIO(), width=100, force_terminal=terminal)
    progress = progress_on(console)
    for _ in range(2):
        run_with(progress)
    assert console.file.getvalue().count("100.0 of 100.0 us  step 1000") == 2
    lines = [line for line in console.file.getvalue().splitlines() if "step 0 " in line]
    assert terminal or not any("left" in line for line in lines)


def test_a_long_run_is_not_silent(monkeypatch):
    """No time left is told from the first step alone; later a line every half minute, however far away the end is."""
    console, now = Console(file=io.StringIO(), width=60), [0.0]
    monkeypatch.setattr(progress_bar.wall_clock, "monotonic", lambda: now[0])
    progress = progress_on(console)
    for step in range(100):
        now[0] = float(step)
        progress.update((step + 1) * 1e-6, 1.0, step, "2.61 GPa")
    lines = console.file.getvalue().splitlines()
    assert len(lines) == 4
    assert "left" not in lines[0]
    assert lines[1].endswith("  999969 s left")  # 30 seconds for 30 of the other 999,969 microseconds
