"""The capstan law: the tensions that dry friction allows in tendons that run through holes.

Index j counts tendons, k spans from 0 at the base; hole k lies just before span k. A tendon ends behind span
`ends[j] - 1`. `catheter_sim.simulation.friction` says what is solved and why.
"""
