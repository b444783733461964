"""From a capture to checked data: scan, photos, masks and lights."""
