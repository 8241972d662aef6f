"""The bench of hidden effects in motion: data by a finer model, which shares no code with what is judged."""
