"""Parametric anatomies."""
