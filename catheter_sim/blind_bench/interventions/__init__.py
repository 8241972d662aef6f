"""A blind bench of interventions: two recordings of one robot; one thing, two or nothing changed in between.

Robots, laws and noise are those of `blind_bench.nature`, and so is what that package says of itself: nothing
here that makes data imports `effects`, `diagnosis` or `theory`.
"""
