"""What every scan gets wrong: unknowns that are always in the model, and are no cause."""
