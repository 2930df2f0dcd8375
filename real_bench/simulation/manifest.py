"""What a scene's manifest may say: the bodies of a world, where they start, the camera, and limits.

Lengths are metres, angles radians, quaternions (x, y, z, w).
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import Annotated

from pydantic import Field, model_validator

from real_bench.inputs.records import Record
from real_bench.inputs.spelling import Sha256, spelled

Vector2 = tuple[float, float]
Vector3 = tuple[float, float, float]
NineNumbers = Annotated[tuple[float, ...], Field(min_length=9, max_length=9)]
Name = Annotated[
    str,
    spelled(
        "[A-Za-z][A-Za-z0-9_-]{0,31}",
        "a name has up to 32 letters, digits, _ and -, and begins with a letter",
    ),
]
Wheel = Annotated[
    str, spelled("[A-Za-z0-9._-]+==[A-Za-z0-9.]+", "write a package and its version: name==1.0")
]


class Assets(Record):
    """Where the files of a scene are: beside the manifest, or installed from a wheel.

    Attributes:
        wheel: the package and version that holds them, as ``name==version``; without it they are
            beside the manifest.
        sha256: of the wheel's file.
        folder: in which they are: in the wheel, or beside the manifest.
    """

    wheel: Wheel | None = None
    sha256: Sha256 | None = None
    folder: str = "."

    @model_validator(mode="after")
    def _wheel_is_checked(self) -> Assets:
        if (self.wheel is None) != (self.sha256 is None):
            raise ValueError("a wheel needs its sha256, and a sha256 its wheel")
        return self


class RobotSpec(Record):
    """The arm and gripper; joints and links by their names in the URDF.

    Attributes:
        urdf: its file, in the assets' folder.
        position: of its base, metres.
        arm_joints: the seven of the arm, from the base on.
        finger_base_joints: the first joints of the two fingers; the first one is observed.
        finger_tip_joints: their second joints; the first one is observed.
        end_effector: the link that inverse kinematics places.
        touch_links: the links whose largest contact force is observed.
    """

    urdf: str
    position: Vector3
    arm_joints: Annotated[tuple[str, ...], Field(min_length=7, max_length=7)]
    finger_base_joints: tuple[str, str]
    finger_tip_joints: tuple[str, str]
    end_effector: str
    touch_links: tuple[str, str, str, str]


class Body(Record):
    """A body and the pose in which it starts (metres, Euler angles in radians).

    Attributes:
        name: of the body.
        urdf: its file, in the assets' folder.
        position: where it starts, metres.
        euler: how it starts turned, radians about x, y, z.
    """

    name: Name
    urdf: str
    position: Vector3
    euler: Vector3 = (0.0, 0.0, 0.0)


class Table(Record):
    """The table that carries the objects.

    Attributes:
        urdf: its file, in the assets' folder.
        position: metres.
    """

    urdf: str
    position: Vector3


class CameraSpec(Record):
    """The fixed camera.

    Attributes:
        eye: where it is, metres.
        target: what it looks at, metres.
        up: which way is up in its images.
        vertical_field_of_view_deg: degrees.
        near, far: the distances between which it sees, metres.
        width, height: of its images, pixels.
    """

    eye: Vector3
    target: Vector3
    up: Vector3
    vertical_field_of_view_deg: Annotated[float, Field(gt=0, lt=180)]
    near: Annotated[float, Field(gt=0)]
    far: Annotated[float, Field(gt=0)]
    width: Annotated[int, Field(ge=16, le=4096)]
    height: Annotated[int, Field(ge=16, le=4096)]

    @model_validator(mode="after")
    def _near_is_nearer(self) -> CameraSpec:
        if self.near >= self.far:
            raise ValueError("near must be less than far")
        return self


class FallenRegion(Record):
    """Where an object counts as fallen: below a height and, if given, beyond an x.

    Attributes:
        z_below: metres.
        x_above: metres; everywhere by default.
    """

    z_below: float
    x_above: float = -math.inf


class CommandLimits(Record):
    """Limits of commands.

    Attributes:
        command_low_in_pi, command_high_in_pi: the least and greatest of the nine joint commands,
            multiples of pi radians: the arm, the gripper's first and second joints.
        command_reach: how far a command may be from the joint's present angle, radians.
        cartesian_low, cartesian_high: where the end effector may be sent, metres.
        macro_low, macro_high: where macros may begin and end, x and y in metres.
        fallen: where an object counts as fallen and is put back to where it starts.
    """

    command_low_in_pi: NineNumbers
    command_high_in_pi: NineNumbers
    command_reach: NineNumbers
    cartesian_low: Vector3
    cartesian_high: Vector3
    macro_low: Vector2
    macro_high: Vector2
    fallen: tuple[FallenRegion, ...]

    @cached_property
    def command_low(self) -> tuple[float, ...]:
        """Lowest command, (9,) radians."""
        return tuple(number * math.pi for number in self.command_low_in_pi)

    @cached_property
    def command_high(self) -> tuple[float, ...]:
        """Highest command, (9,) radians."""
        return tuple(number * math.pi for number in self.command_high_in_pi)

    @model_validator(mode="after")
    def _low_is_below_high(self) -> CommandLimits:
        for what in ("command", "cartesian", "macro"):
            suffix = "_in_pi" if what == "command" else ""
            low, high = getattr(self, f"{what}_low{suffix}"), getattr(self, f"{what}_high{suffix}")
            if any(a >= b for a, b in zip(low, high, strict=True)):
                raise ValueError(f"{what}_low{suffix} must be below {what}_high{suffix} everywhere")
        return self


class GoalRegion(Record):
    """Where goals are drawn from, and from which height objects drop.

    Attributes:
        table_low, table_high: of the table, x and y in metres.
        table_drop_height: from which an object drops onto the table, metres.
        shelf_x_high: the end of the shelf, metres.
        shelf_drop_height: from which an object drops onto the shelf, metres.
        shelf_drop_from_x: where the shelf begins, metres.
    """

    table_low: Vector2
    table_high: Vector2
    table_drop_height: float
    shelf_x_high: float
    shelf_drop_height: float
    shelf_drop_from_x: float

    @model_validator(mode="after")
    def _low_is_below_high(self) -> GoalRegion:
        if any(a >= b for a, b in zip(self.table_low, self.table_high, strict=True)):
            raise ValueError("table_low must be below table_high everywhere")
        if self.shelf_x_high <= self.table_low[0]:
            raise ValueError("shelf_x_high must be above the x of table_low")
        return self


class Manifest(Record):
    """What a scene's YAML file says.

    Attributes:
        name: of the scene.
        assets: where its files are.
        robot: the arm and gripper.
        table: what carries the objects.
        objects: in order; a test with n objects takes the first n.
        camera: the fixed one.
        limits: of commands.
        goals: where they are drawn.
    """

    name: Name
    assets: Assets
    robot: RobotSpec
    table: Table
    objects: Annotated[tuple[Body, ...], Field(min_length=1)]
    camera: CameraSpec
    limits: CommandLimits
    goals: GoalRegion

    @model_validator(mode="after")
    def _names_are_unique(self) -> Manifest:
        if len({body.name for body in self.objects}) < len(self.objects):
            raise ValueError("every object needs a name of its own")
        return self
