"""A continuum robot from somebody's MJCF: a chain of hinges with tendons becomes a robot of this package."""

from catheter_sim.kinds.continuum.from_mjcf.chain import ReadChain, read_chain

__all__ = ["ReadChain", "read_chain"]
