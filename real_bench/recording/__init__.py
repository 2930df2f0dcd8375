"""Recordings of the intrinsic phase: schema, writer, reader."""

from real_bench.recording.experience import Experience
from real_bench.recording.header import Header
from real_bench.recording.reader import MOVED_M, Recording
from real_bench.recording.recorder import Recorder, ResumePoint, Snapshot
from real_bench.recording.state import ControllerState

__all__ = [
    "MOVED_M",
    "ControllerState",
    "Experience",
    "Header",
    "Recorder",
    "Recording",
    "ResumePoint",
    "Snapshot",
]
