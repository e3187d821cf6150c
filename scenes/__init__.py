"""Shipped scenes, one file each: `def scene(*, ...) -> Scene`. Names with a leading underscore are no scenes."""
