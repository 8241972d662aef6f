"""Hypotheses fitted to trials: least squares, what a fit is worth, how sure its numbers are."""
