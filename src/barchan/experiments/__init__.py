"""Ready scenes."""
