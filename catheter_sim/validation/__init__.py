"""Simulation against analytic models and published values."""
