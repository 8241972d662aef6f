"""What the errors that a model leaves depend on."""
