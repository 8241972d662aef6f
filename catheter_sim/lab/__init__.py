"""A laboratory: a robot on a bench that plays inputs and is read, simulated or real.

It knows nothing of the diagnosis (a test walks its imports), as a real bench knows nothing of it. Two
backends: `simulated`, a stand-in whose hidden causes follow the physics of `lab.forms`, which shares no law
with the effects that a diagnosis fits; `recorded`, a folder in which a real bench puts its
recordings.
"""
