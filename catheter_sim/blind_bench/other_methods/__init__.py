"""What people do instead of a diagnosis, on the same data, with the same twin: for comparison only."""
