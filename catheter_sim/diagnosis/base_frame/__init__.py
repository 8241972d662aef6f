"""Where the tracker stands: measured positions are moved into the robot's base frame before any fit."""
