"""From measured data to a diagnosis: what the simulation gets wrong, and why."""
