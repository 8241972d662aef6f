"""What changed between two recordings of one robot: what both share is taken out, the rest is diagnosed."""
