"""A disk that is full, or that may only be read: one line, and what is there is whole."""

import csv
import json
import subprocess
from contextlib import contextmanager

import numpy as np
import pytest
from pxr import Usd

from warp_mpm.cli import main

RUN = ("run", "two_point", "--set", "cell_size=2e-2", "--frames", "5", "--checkpoint-steps", "20", "--device", "cpu")
ROOM = {  # of which the run, which needs about 900 kB, leaves nothing for its [kB]
    "first file": 4,
    "first frame": 40,
    "second frame": 80,
    "pictures and checkpoint": 200,
    "second checkpoint": 400,
    "last picture": 600,
}


@contextmanager
def mounted(directory, *options):
    """A file system in memory at a directory; skips the test where none may be mounted."""
    try:
        command = ["mount", "-t", "tmpfs", *options, "tmpfs", str(directory)]
        mount = subprocess.run(command, check=False, capture_output=True, text=True)
    except OSError:
        pytest.skip("this system has no mount")
    if mount.returncode != 0:
        pytest.skip(f"no disk to fill, as only root may mount one: {mount.stderr.strip()}")
    try:
        yield
    finally:
        subprocess.run(["umount", "-l", str(directory)], check=True)


def read(path):
    """Read a file to its end, whatever it is."""
    if path.suffix in (".usda", ".usdc"):
        assert Usd.Stage.Open(str(path))
    elif path.suffix == ".npz":
        with np.load(path, allow_pickle=False) as arrays:
            assert all(arrays[name] is not None for name in arrays)
    elif path.suffix == ".json":
        json.loads(path.read_text())
    elif path.suffix == ".csv":
        header, *rows = csv.reader(path.read_text().splitlines())
        assert all(len(row) == len(header) for row in rows)
    else:
        assert path.suffix == ".png"
        assert path.read_bytes().endswith(b"IEND\xaeB`\x82")


@pytest.mark.parametrize("layout", ["auto", "clips"])
@pytest.mark.parametrize("room", ROOM.values(), ids=ROOM)
def test_a_full_disk_leaves_whole_files(capfd, tmp_path, room, layout):
    with mounted(tmp_path, "-o", f"size={room}k"):
        assert main([*RUN, "--layout", layout, "-o", str(tmp_path)]) == 1
        error = capfd.readouterr().err
        assert error.startswith(f"warp-mpm: cannot write {tmp_path}")
        assert "No space left on device; free some space" in error
        assert error.count("\n") == 1
        files = [path for path in tmp_path.rglob("*") if path.is_file()]
        assert [path for path in files if ".part" in path.name] == []
        for path in files:
            read(path)


def test_a_disk_that_may_only_be_read_is_one_line(capfd, tmp_path):
    with mounted(tmp_path, "-o", "ro"):
        for output in (tmp_path, tmp_path / "new"):
            assert main([*RUN, "-o", str(output)]) == 2
            error = capfd.readouterr().err
            assert "expected a directory that can be written" in error
            assert error.count("\n") == 1


def test_pictures_and_exports_say_that_there_is_no_room(capfd, tmp_path):
    """The run they are made of stays as it is."""
    assert main([*RUN, "-o", str(tmp_path / "run")]) == 0
    before = {path: path.read_bytes() for path in (tmp_path / "run").rglob("*") if path.is_file()}
    full = tmp_path / "full"
    full.mkdir()
    capfd.readouterr()
    with mounted(full, "-o", "size=40k"):
        for command in (
            ("figures", str(tmp_path / "run"), "-o", str(full / "figures")),
            ("export", str(tmp_path / "run"), "--to", str(full / "run.pvd")),
            ("export", str(tmp_path / "run"), "--to", str(full / "run.glb"), "--frame", "3"),
        ):
            assert main(list(command)) in (1, 2)
            error = capfd.readouterr().err
            assert error.startswith("warp-mpm: cannot write")
            assert error.count("\n") == 1
            assert [path for path in full.rglob("*") if ".part" in path.name] == []
    assert {path: path.read_bytes() for path in (tmp_path / "run").rglob("*") if path.is_file()} == before
