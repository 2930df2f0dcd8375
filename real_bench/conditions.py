"""The conditions of the benchmark, as the paper names them: REAL_OM, REAL_IM, REAL_IJ etc."""

from __future__ import annotations

from dataclasses import dataclass

from real_bench.controls import CONTROLS, Control
from real_bench.errors import RealBenchError

PERCEPTIONS = {"O": "object positions", "I": "images"}


class ConditionError(RealBenchError, ValueError):
    """A condition that does not exist."""


@dataclass(frozen=True)
class Condition:
    """What the robot perceives and how it is controlled (paper, section Simplifications).

    Attributes:
        perception: ``O``, it sees object positions and masks; ``I``, it does not.
        control: ``M`` macro-actions, ``J`` joints, ``C`` cartesian.
    """

    perception: str
    control: str

    @classmethod
    def parse(cls, name: str) -> Condition:
        """Parse a name like ``OM``; raises ConditionError with the valid names."""
        if name in CONDITION_NAMES:
            return cls(name[0], name[1])
        raise ConditionError(f"unknown condition {name!r}: use one of {', '.join(CONDITION_NAMES)}")

    @property
    def name(self) -> str:
        """Two letters, as in the paper's REAL_OM."""
        return self.perception + self.control

    @property
    def control_type(self) -> type[Control]:
        """The class of its way of control."""
        return CONTROLS[self.control]

    @property
    def control_version(self) -> int:
        """The version of its way of control."""
        return self.control_type.version

    def control_mismatch(self, version: int) -> str | None:
        """Why a run with another version of this control cannot be continued; None if it can.

        Args:
            version: of the control, as a recording or result has it.
        """
        if version == self.control_version:
            return None
        return (
            f"its {self.control_type.name} have version {version}, this realbench has "
            f"{self.control_version}: the same commands move the robot slightly differently"
        )

    @property
    def sees_objects(self) -> bool:
        """Whether positions, orientations and masks of objects are observed."""
        return self.perception == "O"


CONDITION_NAMES = tuple(p + c for p in PERCEPTIONS for c in CONTROLS)
