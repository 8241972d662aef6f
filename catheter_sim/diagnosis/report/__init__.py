"""What a diagnosis returns, and how it is written: values first, JSON, pictures and HTML."""
