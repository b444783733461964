"""A simulated object of several materials, photographed by Cycles, scanned by a stereo tool."""
