"""Static models of notched tubes."""
