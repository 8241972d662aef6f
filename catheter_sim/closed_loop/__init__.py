"""Diagnose, propose, measure, diagnose again: until one cause is sure or the budget ends.

It joins a bench (`lab`) and the diagnosis, which know nothing of one another.
"""
