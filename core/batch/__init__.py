"""A command over a collection of captures: what is to do, what is done, and a page about all."""
