"""Hidden causes in models that this package did not make, by laws that their diagnosis does not share."""
