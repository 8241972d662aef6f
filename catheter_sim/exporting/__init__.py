"""A robot with its effects as one MJCF that plain MuJoCo runs, and what is lost on the way."""
