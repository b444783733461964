"""Commands that are killed, or run on a full disk or in a folder that vanishes."""
