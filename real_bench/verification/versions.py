"""Versions and physics that may change the bits of a replay."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from real_bench.physics import UNKNOWN, fingerprint, physics_of
from real_bench.provenance import package_versions
from real_bench.text.quoting import quoted

DECISIVE = ("pybullet", "numpy")


@dataclass(frozen=True)
class Physics:
    """The physics that something was made with, and that of this machine.

    Attributes:
        then: as the file says; ``unknown`` if it is older.
        here: of this machine.
    """

    then: str
    here: str

    @classmethod
    def of(cls, versions: Mapping[str, str]) -> Physics:
        """Of what was made with these versions."""
        return cls(quoted(physics_of(versions)), fingerprint())

    @property
    def differs(self) -> bool:
        """Whether the same commands are known to end differently here."""
        return self.then not in (UNKNOWN, self.here)

    def notes(self) -> list[str]:
        """What should be known of it."""
        if self.then == UNKNOWN:
            return [f"its physics is unknown, here it is {self.here}: bits may differ"]
        if self.differs:
            return [f"its physics is {self.then}, here it is {self.here}: bits cannot agree"]
        return []


def versions_differ(recorded: Mapping[str, str]) -> list[str]:
    """A note for each package whose version differs here."""
    here = package_versions()
    return [
        f"{name} was {quoted(recorded.get(name, 'unknown'))}, here it is {here[name]}: "
        "bits may differ"
        for name in DECISIVE
        if recorded.get(name) != here[name]
    ]
