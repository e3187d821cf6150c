"""What a run leaves behind: USD, pictures, tables."""
