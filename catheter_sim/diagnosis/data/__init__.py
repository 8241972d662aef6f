"""Measured data: trials, how they are parted, and the folder that they are read from."""
