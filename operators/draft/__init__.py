"""Set up a new capture: add files, group photos by lamp, create it."""
