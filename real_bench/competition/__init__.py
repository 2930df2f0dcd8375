"""Competitions: submissions, rounds in which they are tested, and leaderboards."""

from real_bench.competition.manifest import Submission, read_submission

__all__ = ["Submission", "read_submission"]
