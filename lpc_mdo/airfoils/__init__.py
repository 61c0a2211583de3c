"""Sections of wings and blades: their names, coordinate files and outlines."""
