"""Equations that several kinds of robots share, an equation family a file."""
