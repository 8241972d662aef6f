"""Values and contracts that all else stands on."""
