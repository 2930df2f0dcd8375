"""Experiments: many plays and tests, described in one file, run on one machine or many."""

from real_bench.experiments.spec import Cell, DrawnGoals, Play, Published, Spec, read_spec

__all__ = ["Cell", "DrawnGoals", "Play", "Published", "Spec", "read_spec"]
