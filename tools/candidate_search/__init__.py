"""The search of a well-conditioned set among very many candidates."""
