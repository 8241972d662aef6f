"""Other programs beside this one, on one rod, in one run: one file a program, and the table in `table`."""
