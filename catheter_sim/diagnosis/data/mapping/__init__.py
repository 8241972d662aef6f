"""Files as trackers and loggers write them, and the table `[map]` that says what their columns mean."""
