"""Causes: which are tried, which pay, and which stay named."""
