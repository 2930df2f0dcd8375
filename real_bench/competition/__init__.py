"""Competitions: rounds in which submissions are tested, and leaderboards."""
