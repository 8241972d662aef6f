"""Equilibrium of a robot whose subsegments have few degrees of freedom each (CC_sub and PRB), compiled.

**Equations.** Subsegment k (its base is disk k) has d unknowns and d balances: the moment M_k(c) of
everything beyond it about a point c, along an axis a, is the elastic moment s,

    r = a . (M_k about c) - s,

with a, c and s functions of the subsegment's own unknowns (`subsegments`). `forces` sums up what lies beyond
each place, `balance` says what the balances lack and how that changes with the unknowns, `newton` solves.
"""
