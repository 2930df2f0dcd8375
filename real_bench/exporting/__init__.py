"""Export a recording: tables, and datasets of other libraries."""

from real_bench.exporting.formats import FORMATS, Export

__all__ = ["FORMATS", "Export"]
