"""The stages of the workflow, as the artist sees them."""
