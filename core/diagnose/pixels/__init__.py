"""Which pixels of the photos a diagnosis uses, and where in a photo they lie."""
