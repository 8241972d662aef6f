"""Simulation of tendon- and rod-driven medical continuum robots in MuJoCo, checked against theory.

Importing the package registers its Gymnasium environments (`catheter_sim/<Robot><Task>-v0`).
"""

__version__ = "0.1.0"
