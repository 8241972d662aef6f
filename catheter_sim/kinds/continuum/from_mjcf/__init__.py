"""A continuum robot from somebody's MJCF: a chain of hinges with tendons becomes a robot of this package."""
