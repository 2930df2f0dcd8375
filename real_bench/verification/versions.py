"""Versions that may change the bits of a replay."""

from __future__ import annotations

from collections.abc import Mapping

from real_bench.quoting import quoted
from real_bench.recording import package_versions

DECISIVE = ("pybullet", "numpy")


def versions_differ(recorded: Mapping[str, str]) -> list[str]:
    """A note for each package that is another here than it was then."""
    here = package_versions()
    return [
        f"{name} was {quoted(recorded.get(name, 'unknown'))}, here it is {here[name]}: "
        "bits may differ"
        for name in DECISIVE
        if recorded.get(name) != here[name]
    ]
