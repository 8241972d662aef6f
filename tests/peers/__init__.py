"""Other programs beside this one, on one rod, in one run: a file a program, and the table."""
