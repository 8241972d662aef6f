"""Clinical tasks: a robot is pushed into a parametric anatomy whose tissue must not be pressed hard."""
