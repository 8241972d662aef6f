"""What changed between recordings of one robot."""
