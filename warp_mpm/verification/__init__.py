"""Verification: problems with exact answers, solved and judged by `warp-mpm verify`.

`problem` says what a problem is, `problems` holds them, one file each; `norms` and `fields` compare; `session` solves
and judges; `report` and `pictures` show.
"""

from warp_mpm.verification.fields import cell_means, pressure_error
from warp_mpm.verification.norms import relative_l1

__all__ = ["cell_means", "pressure_error", "relative_l1"]
