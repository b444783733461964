"""What the forward model gets wrong: shown, named, put into the model, measured."""
