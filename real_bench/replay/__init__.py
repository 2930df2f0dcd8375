"""Replay of recordings: for proof, films, and pybullet's window."""

from real_bench.replay.actions import ActionReplayer, fresh_states
from real_bench.replay.part import PartReplay

__all__ = ["ActionReplayer", "PartReplay", "fresh_states"]
