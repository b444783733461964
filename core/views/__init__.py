"""Pictures of a measurement: its charts, and what the photos say of it."""
