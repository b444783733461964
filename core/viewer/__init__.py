"""The viewer: one HTML page that shows an object with its measured BRDFs in any browser."""
