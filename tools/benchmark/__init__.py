"""What `tools/bench.py` measures with: runs to time, limits of the machine, counted bytes and operations, reports."""
