"""Files that a user names."""
