"""What the neighbour list is, and when it must be rebuilt."""
