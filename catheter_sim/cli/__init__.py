"""The command `catheter-sim`: one file per verb; this is the only part of the package that prints."""
