"""The version of the package, in one place."""

__version__ = "0.1.0"

SOURCE = "real-bench source"
"""The name of the hash of our own code among the versions that recordings and results keep."""
