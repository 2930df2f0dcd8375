"""The robot of a world: its joints by command, its touch sensors, its inverse kinematics."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from real_bench.errors import SceneError
from real_bench.simulation.bullet import pybullet
from real_bench.simulation.scene import Scene

TOUCH_DISTANCE = 0.1
BASE_LINK = -1
IK_ITERATIONS = 1000
IK_RESIDUAL = 0.001
INITIAL_GAIN = 0.1
ROUNDING = 1e-9


class Robot:
    """The loaded robot; nine commands drive eleven joints.

    Command 7 drives both finger bases, command 8 (sign flipped) both finger tips.
    """

    def __init__(self, scene: Scene, client: int) -> None:
        spec = scene.manifest.robot
        self.client = client
        self.body = load_body(scene, spec.urdf, pybullet.URDF_GOOGLEY_UNDEFINED_COLORS, client)
        pybullet.resetBasePositionAndOrientation(
            self.body, spec.position, (0, 0, 0, 1), physicsClientId=client
        )
        joints, links = self._names()
        try:
            arm = [joints[name] for name in spec.arm_joints]
            bases = [joints[name] for name in spec.finger_base_joints]
            tips = [joints[name] for name in spec.finger_tip_joints]
            self._end_effector = links[spec.end_effector]
            self._touch_links = [links[name] for name in spec.touch_links]
        except KeyError as error:
            raise SceneError(
                f"scene {scene.name}: {spec.urdf} has no joint or link {error}"
            ) from error
        limits = scene.manifest.limits
        self._ranges = list(
            zip(limits.command_reach, limits.command_low, limits.command_high, strict=True)
        )
        self.all_joints = range(len(joints))
        self.observed_joints = [*arm, bases[0], tips[0]]
        self.driven_joints = [*arm, *bases, *tips]
        self.switch_motors_off()

    def switch_motors_off(self) -> None:
        """Give every joint a position motor without force."""
        for joint in self.all_joints:
            pybullet.setJointMotorControl2(
                self.body,
                joint,
                pybullet.POSITION_CONTROL,
                targetPosition=0,
                positionGain=INITIAL_GAIN,
                velocityGain=INITIAL_GAIN,
                force=0,
                physicsClientId=self.client,
            )

    def set_joint_positions(self, positions: NDArray[np.float64]) -> None:
        """Put the joints at nine angles (as observed), at rest."""
        angles = dict.fromkeys(self.all_joints, 0.0)
        mine = [
            *positions[:8],
            0.0 - positions[8],
        ]  # never -0: at 0 it is observed as -0, as in the official environment
        angles.update(zip(self.driven_joints, [*mine[:8], mine[7], mine[8], mine[8]], strict=True))
        for joint, angle in angles.items():
            pybullet.resetJointState(self.body, joint, angle, 0, physicsClientId=self.client)

    def joint_positions(self) -> NDArray[np.float64]:
        """The nine observed joint angles, (9,) radians."""
        states = pybullet.getJointStates(self.body, self.observed_joints, self.client)
        angles = np.array([state[0] for state in states])
        angles[8] = -angles[8]
        return angles

    def joint_targets(self, command: Sequence[float]) -> list[JointTarget]:
        """How each of the nine observed joints goes to a command.

        The tip has the sign of its joint, not of the command.
        """
        targets = [
            JointTarget.to(wanted, *limits)
            for wanted, limits in zip(command, self._ranges, strict=True)
        ]
        reach, low, high = self._ranges[8]
        targets[8] = JointTarget.to(-command[8], reach, -high, -low)
        return targets

    def touch_sensors(self) -> NDArray[np.float64]:
        """The largest normal force on each of the four skins, (4,) newtons; 0 without contact.

        As in the official environment, only a body's base link is felt, not the table's shelf.
        """
        return np.array([self._largest_force(link) for link in self._touch_links])

    def link_position(self, name: str) -> NDArray[np.float64]:
        """Where the centre of mass of a link is, (3,) metres; raises KeyError."""
        _, links = self._names()
        state = pybullet.getLinkState(self.body, links[name], physicsClientId=self.client)
        return np.array(state[0])

    def contacts(self) -> list[tuple[str, int]]:
        """Points of contact: the robot's link, and the body whose base link it touches."""
        names = {link: name for name, link in self._names()[1].items()}
        points = pybullet.getContactPoints(bodyA=self.body, physicsClientId=self.client)
        return [(names[point[3]], point[2]) for point in points if _is_touch(point)]

    def inverse_kinematics(
        self, position: tuple[float, ...], quaternion: tuple[float, ...]
    ) -> tuple[float, ...]:
        """Joint angles that bring the gripper to a pose, solved from the present state.

        One number for each movable joint of the URDF, in its order.
        """
        solution: tuple[float, ...] = pybullet.calculateInverseKinematics(
            self.body,
            self._end_effector,
            position,
            quaternion,
            maxNumIterations=IK_ITERATIONS,
            residualThreshold=IK_RESIDUAL,
            physicsClientId=self.client,
        )
        return solution

    def _largest_force(self, link: int) -> float:
        contacts = pybullet.getContactPoints(
            bodyA=self.body, linkIndexA=link, physicsClientId=self.client
        )
        return max((contact[9] for contact in contacts if _is_touch(contact)), default=0.0)

    def _names(self) -> tuple[dict[str, int], dict[str, int]]:
        count = pybullet.getNumJoints(self.body, physicsClientId=self.client)
        infos = [
            pybullet.getJointInfo(self.body, joint, physicsClientId=self.client)
            for joint in range(count)
        ]
        joints = {info[1].decode(): info[0] for info in infos}
        links = {info[12].decode(): info[0] for info in infos}
        return joints, links


def _is_touch(contact: tuple[Any, ...]) -> bool:
    return bool(contact[4] == BASE_LINK and abs(contact[8]) < TOUCH_DISTANCE)


def load_body(scene: Scene, urdf: str, flags: int, client: int) -> int:
    """Load a URDF of a scene; returns pybullet's id of the body."""
    path = scene.path(urdf)
    try:
        body: int = pybullet.loadURDF(str(path), flags=flags, physicsClientId=client)
    except pybullet.error as error:
        raise SceneError(f"scene {scene.name}: {path} cannot be loaded: {error}") from error
    return body


class JointTarget(NamedTuple):
    """How one joint goes to a command, laid out for the simulation's loop.

    The official environment moves the target to within a reach of the joint's angle, as
    ``angle + clipped difference``, and then clips it to the joint's range; the roundings of that
    sum are part of the outcome. Where clipping cannot matter, the loop only adds.

    Attributes:
        wanted: the command, radians.
        back, ahead: between these differences (wanted - angle) the target is their sum.
        lowest, highest: between these, ``angle + ahead`` (or ``back``) needs no clipping.
        clipped: the target for any angle.
    """

    wanted: float
    back: float
    ahead: float
    lowest: float
    highest: float
    clipped: Callable[[float], float]

    @classmethod
    def to(cls, wanted: float, reach: float, low: float, high: float) -> JointTarget:
        """The way to a command, for a joint with a reach and a range."""

        def clipped(angle: float) -> float:
            step = min(max(wanted - angle, -reach), reach)
            return min(max(angle + step, low), high)

        # At a limit the sum may be rounded out of the range; not at 0, where it is exact.
        if low + ROUNDING < wanted < high - ROUNDING or wanted == 0:
            return cls(wanted, -reach, reach, low, high, clipped)
        return cls(wanted, math.inf, -math.inf, math.inf, -math.inf, clipped)


def expand_to_driven_joints(targets: list[float]) -> list[float]:
    """The targets of the eleven driven joints, from those of the nine observed ones.

    The tips close by at most twice the angle of the bases, and never open beyond straight.
    """
    base = targets[7]
    tip = max(min(targets[8], 0.0), -2 * base)
    return [*targets[:8], base, tip, tip]
