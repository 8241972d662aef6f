"""A data set proposed from files as they were measured: from their heads, values, and the robot's motion."""
