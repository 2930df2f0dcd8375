"""The header of every recording: what it takes to repeat a run."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field, field_validator

from real_bench.conditions import Condition
from real_bench.errors import RecordingError
from real_bench.fields import Seed
from real_bench.inputs.records import Record
from real_bench.text.counting import counted
from real_bench.text.quoting import quoted

FIELDS_TO_RESUME = (
    "condition",
    "control_version",
    "objects",
    "scene",
    "scene_sha256",
    "seed",
    "settings",
    "images",
)


class Header(Record):
    """Facts of a run that stay the same from its first step to its last.

    Attributes:
        condition: two letters, as in the paper.
        control_version: of the way of control; 1 in recordings made before it was kept.
        objects: number of objects.
        object_names: their names, in order.
        scene: name of the scene.
        scene_source: what the scene is found by: its name, or the path of its manifest.
        scene_sha256: hash of the scene's manifest and files.
        seed: of the run, below 2**63.
        controller: as the user named it, of a file without its folder.
        controller_source: the same, with the whole path of a file, so that it is found again here.
        controller_class: the class that it is.
        controller_sha256: hash of all code that it could import as its own (in early
            recordings, of the file that defines it).
        settings: of the controller, whole; empty where it has none.
        images: whether camera images are recorded.
        versions: of Python and the packages that can change the outcome, and the physics.
    """

    condition: str
    control_version: int = Field(ge=1, lt=2**31)
    objects: int = Field(ge=1)
    object_names: tuple[str, ...]
    scene: str
    scene_source: str
    scene_sha256: str = Field(pattern="^[0-9a-f]{64}$")
    seed: Seed
    controller: str
    controller_source: str
    controller_class: str
    controller_sha256: str = Field("", pattern="^([0-9a-f]{64})?$")
    settings: dict[str, Any] = Field(default_factory=dict)
    images: bool
    versions: dict[str, str]

    @field_validator("condition")
    @classmethod
    def _condition_exists(cls, name: str) -> str:
        return Condition.parse(name).name

    @property
    def command_size(self) -> int:
        """How many numbers a command vector has."""
        return Condition.parse(self.condition).control_type.size

    def differences(self, other: Header) -> list[str]:
        """Why a run with another header cannot continue this one, as ``field: mine, not yours``."""
        changed = [
            f"{field}: {getattr(self, field)!r}, not {getattr(other, field)!r}"
            for field in FIELDS_TO_RESUME
            if getattr(self, field) != getattr(other, field)
        ]
        if not self.was_made_by(
            other.controller_source, other.controller_sha256, other.controller_class
        ):
            changed.append(f"controller: {self._controller}, not {other._controller}")
        return changed

    @property
    def _controller(self) -> str:
        """The controller by all that tells it from another: place, class and code."""
        code = self.controller_sha256[:12]
        place = quoted(self.controller_source)
        return f"{self.controller!r} (class {self.controller_class} of {place}, code {code})"

    def was_made_by(self, controller_source: str, source_sha256: str, class_name: str) -> bool:
        """Whether the run was made by this controller: of the same place, or the same code."""
        same_code = source_sha256 != "" and self.controller_sha256 == source_sha256
        same_class = self.controller_class == class_name
        return same_class and (self.controller_source == controller_source or same_code)

    def mismatches(self, condition: Condition, objects: int, scene_sha256: str) -> list[str]:
        """Why a test cannot use this run; empty if it can."""
        mine = Condition.parse(self.condition)
        reasons = []
        if objects != self.objects:
            reasons.append(f"it has {counted(self.objects, 'object')}, not {objects}")
        if scene_sha256 != self.scene_sha256:
            reasons.append(f"it was made in another scene ({self.scene} {self.scene_sha256[:12]})")
        if condition.control != mine.control:
            reasons.append(f"its condition is {mine.name}, not {condition.name}")
        elif mismatch := mine.control_mismatch(self.control_version):
            reasons.append(f"{mismatch} (play again)")
        elif condition.sees_objects and not mine.sees_objects:
            reasons.append(f"a run in {mine.name} must not reveal positions to {condition.name}")
        return reasons

    def check_fits(self, run: Path, condition: Condition, objects: int, scene_sha256: str) -> None:
        """Raise RecordingError, which names the file ``run``, if a test cannot use this run."""
        if reasons := self.mismatches(condition, objects, scene_sha256):
            raise RecordingError(f"{run} does not fit this test: {'; '.join(reasons)}")

    def check_state_is_allowed(self, condition: Condition) -> None:
        """Raise RecordingError if what was learned could reveal positions to an I condition."""
        if Condition.parse(self.condition).sees_objects and not condition.sees_objects:
            raise RecordingError(
                f"the controller played in {self.condition}, where it saw positions: what it "
                f"learned must not be used in {condition.name} (play in {condition.name} instead)"
            )

    def to_attributes(self) -> dict[str, Any]:
        """As HDF5 attributes: numbers and text as they are, the rest as JSON."""
        fields = self.model_dump(mode="json")
        return {
            key: json.dumps(value) if isinstance(value, dict | list) else value
            for key, value in fields.items()
        }

    @classmethod
    def from_attributes(cls, attributes: dict[str, Any]) -> Header:
        """Read and check what :meth:`to_attributes` wrote; raises ValueError."""
        # the first recordings have neither
        attributes = {"settings": "{}", "control_version": 1, **attributes}
        fields = {key: _plain(attributes[key]) for key in cls.model_fields}
        for key in ("object_names", "settings", "versions"):
            fields[key] = json.loads(fields[key])
        return cls.model_validate(fields)


def _plain(value: Any) -> Any:
    """An attribute as a Python value, not a numpy one."""
    return value.item() if isinstance(value, np.generic) else value
