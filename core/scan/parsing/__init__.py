"""What the readers share: files opened without believing them, labels, sizes, sparse points."""
