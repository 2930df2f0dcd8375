"""A module with the name of one of Python's."""

START = 0.3
