"""Open and check the data of a capture: scan, photos, masks and lights."""
