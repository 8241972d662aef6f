"""A blind bench whose data are made by physics that is written a second time.

Nothing here imports `effects`, `diagnosis`, `theory` or a kind's statics: a robot is changed by
`dataclasses.replace`, driven through the MuJoCo simulation, and looked at by the formulas of this folder.
The simulation's own modules import `effects.apply`, which does nothing to a robot without effects; every
robot here has none. So a diagnosis meets laws that it does not share, and forms that it does not know.
"""
