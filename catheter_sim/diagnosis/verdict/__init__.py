"""What the held-out trials and the simulation say of a corrected model, and the verdict on it."""
