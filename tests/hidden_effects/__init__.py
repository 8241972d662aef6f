"""Benches of hidden effects: data with a cause hidden in them, diagnosed in another process, scored."""
