"""Models that this package did not make: any MJCF with actuators, and what measured data say against it."""
