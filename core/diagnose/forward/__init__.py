"""The forward model without effects: surface, light, visibility, radiosity, surroundings."""
