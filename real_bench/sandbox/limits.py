"""Limits on what a controller may use."""

from __future__ import annotations

from dataclasses import dataclass

from real_bench.errors import RealBenchError

GIB = 2**30
TEMPORARY_BYTES = GIB


@dataclass(frozen=True)
class Limits:
    """What an isolated controller may use before its run ends with an error.

    Attributes:
        memory_gib: address space of its process, GiB. Libraries count as well: torch needs 3 to 4.
        call_s: time per call, seconds; learning is one call.
        total_s: time for all its calls in one process, seconds, without the simulation's.
    """

    memory_gib: float = 8.0
    call_s: float = 3600.0
    total_s: float = 86400.0

    def __post_init__(self) -> None:
        for option, value in (
            ("--memory-limit", self.memory_gib),
            ("--call-limit", self.call_s),
            ("--total-limit", self.total_s),
        ):
            if not 0 < value < 1e9:
                raise RealBenchError(f"{option} must be above 0 (and below 1e9), not {value}")

    @property
    def memory_bytes(self) -> int:
        """The address space in bytes."""
        return int(self.memory_gib * GIB)
