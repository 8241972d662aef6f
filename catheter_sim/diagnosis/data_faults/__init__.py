"""What may be wrong with the data themselves: one kind of fault a file."""
