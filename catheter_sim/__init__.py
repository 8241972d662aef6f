"""Simulation of tendon- and rod-driven medical continuum robots in MuJoCo, checked against theory.

Importing the package registers its Gymnasium environments (`catheter_sim/<Robot><Task>-v0`).
"""

from catheter_sim.envs import register_environments

__version__ = "0.1.0"

register_environments()
