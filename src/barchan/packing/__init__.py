"""Starting states."""
