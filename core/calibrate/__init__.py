"""What the photos themselves say about camera and light: tone from a chart, place of a flash."""
