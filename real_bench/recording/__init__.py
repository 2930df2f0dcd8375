"""Recordings of the intrinsic phase: schema, writer, reader."""

from real_bench.recording.experience import Experience
from real_bench.recording.header import Header, package_versions, run_versions
from real_bench.recording.reader import MOVED_M, Recording
from real_bench.recording.recorder import Cut, Recorder
from real_bench.recording.state import State

__all__ = [
    "MOVED_M",
    "Cut",
    "Experience",
    "Header",
    "Recorder",
    "Recording",
    "State",
    "package_versions",
    "run_versions",
]
