"""What run.py is made of: setting up, building, testing. Nothing here is part of the extension."""
