"""`python -m warp_mpm` is the command line `warp-mpm`."""

import sys

from warp_mpm.cli import main

sys.exit(main())
