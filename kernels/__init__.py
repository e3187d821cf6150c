"""Everything that Warp compiles, and the parameter records it compiles against.

Nothing here allocates an array, launches a kernel, or imports a host module: `warp_mpm` depends on `kernels`, never
the other way round.
"""
