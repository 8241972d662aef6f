"""Static models of all kinds, and the twins that fits go by."""
