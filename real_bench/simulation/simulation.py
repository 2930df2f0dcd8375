"""The simulated world and its loop.

One instance owns one physics client and knows nothing of phases, goals or controllers.
Everything here follows the official environment to the last bit: load order, parameters and the
order of operations within a step all change the outcome, so none of it is free to move.
"""

from __future__ import annotations

import os
import sys
import weakref
from collections.abc import Iterable, Sequence
from typing import NoReturn, SupportsIndex

import numpy as np
from numpy.typing import NDArray

from real_bench.errors import PhysicsError, SceneError
from real_bench.simulation.bullet import pybullet
from real_bench.simulation.camera import Camera, Image
from real_bench.simulation.posture import HOME
from real_bench.simulation.robot import Robot, expand_to_driven_joints, load_body
from real_bench.simulation.scene import Scene
from real_bench.text.counting import counted

STEP_S = 0.005
GRAVITY = (0.0, 0.0, -9.81)

MAX_OBJECT_SPEED = 20.0
"""No object moves faster (m/s), so while it is far from any edge it need not be checked. The
fastest seen in 300 random macros and 600 random joint actions was 4.6 m/s."""

MAX_UNWATCHED_STEPS = 100
TABLE = "table"
SHOWN_COMMANDS = 3

Segment = tuple[Sequence[float], int]
"""Nine joint commands (radians) and the number of steps for which they are held."""


class Simulation:
    """A world of robot, table and objects."""

    def __init__(self, scene: Scene, n_objects: int = 1, *, gui: bool = False) -> None:
        self.scene = scene
        self.object_names = scene.object_names(n_objects)
        if gui and sys.platform.startswith("linux") and not os.environ.get("DISPLAY"):
            # pybullet would end the whole process
            raise SceneError("cannot open pybullet's window: no display (DISPLAY is unset)")
        mode = pybullet.GUI if gui else pybullet.DIRECT
        client: int = pybullet.connect(mode)
        if client < 0:
            raise SceneError("cannot open pybullet's window: only one can be open per process")
        self._client: int | None = client
        # pybullet keeps a world until it is disconnected, even without references to it
        self._end = weakref.finalize(self, pybullet.disconnect, physicsClientId=client)
        self._end.atexit = False
        self._fallen = [(region.z_below, region.x_above) for region in scene.manifest.limits.fallen]
        self.reset()

    @property
    def client(self) -> int:
        """The id that pybullet gave this world; raises SceneError after :meth:`close`."""
        if self._client is None:
            raise SceneError("the simulation is closed")
        return self._client

    @property
    def robot(self) -> Robot:
        """The robot in this world; raises SceneError after :meth:`close`."""
        self.client  # noqa: B018  pybullet gives its number to another world
        return self._robot

    @property
    def camera(self) -> Camera:
        """The camera in this world; raises SceneError after :meth:`close`."""
        self.client  # noqa: B018
        return self._camera

    def reset(
        self,
        object_poses: NDArray[np.float64] | None = None,
        joint_positions: NDArray[np.float64] | None = None,
    ) -> None:
        """Begin a fresh world.

        Args:
            object_poses: where the objects are put, (n_objects, 7): position, quaternion;
                None: the scene's start poses.
            joint_positions: the robot's joints, (9,); None: the home posture.
        """
        client = self.client
        pybullet.resetSimulation(physicsClientId=client)
        pybullet.setAdditionalSearchPath(str(self.scene.folder), physicsClientId=client)
        pybullet.setGravity(*GRAVITY, physicsClientId=client)
        pybullet.setPhysicsEngineParameter(
            fixedTimeStep=STEP_S, numSubSteps=1, numSolverIterations=50, physicsClientId=client
        )
        self._robot = Robot(self.scene, client)
        self._load_table()
        self._load_objects()
        self.robot.set_joint_positions(
            np.array(HOME) if joint_positions is None else joint_positions
        )
        self.robot.switch_motors_off()
        if object_poses is not None:
            self.set_object_poses(object_poses)
        self._camera = Camera(self.scene.manifest.camera, client)
        self._unwatched_steps = 0
        self.n_put_back = self.n_steps = self._last_check_at = 0
        self._held: list[
            Segment
        ] = []  # commands since the last check, each with the step it began at

    def hold(self, command: Sequence[float], n_steps: int) -> None:
        """Hold nine joint commands for ``n_steps`` steps.

        The loop is written for speed: it must cost little compared with Bullet's own step. Raises
        PhysicsError, with step and command, if an object's pose is no longer a number.
        """
        client, body = self.client, self.robot.body
        observed, driven = self.robot.observed_joints, self.robot.driven_joints
        read_joints, step = pybullet.getJointStates, pybullet.stepSimulation
        joints = self.robot.joint_targets(command)
        sent = None
        self._held.append((command, self.n_steps))
        for _ in range(n_steps):
            targets = [
                angle + difference
                if back <= (difference := wanted - angle) <= ahead
                else limited
                if lowest <= (limited := angle + (ahead if difference > 0 else back)) <= highest
                else clipped(angle)
                for (angle, _, _, _), (wanted, back, ahead, lowest, highest, clipped) in zip(
                    read_joints(body, observed, client), joints, strict=True
                )
            ]
            if self._unwatched_steps:
                self._unwatched_steps -= 1
            else:
                self._watch_objects()
            if targets != sent:
                pybullet.setJointMotorControlArray(
                    body,
                    driven,
                    pybullet.POSITION_CONTROL,
                    targetPositions=expand_to_driven_joints(targets),
                    physicsClientId=client,
                )
                sent = targets
            step(client)
            self.n_steps += 1

    def follow(self, segments: Iterable[Segment]) -> None:
        """Hold one command after the other; segments may be made while they are followed."""
        for command, n_steps in segments:
            self.hold(command, n_steps)

    def joint_positions(self) -> NDArray[np.float64]:
        """The nine observed joint angles, (9,) radians; raises PhysicsError."""
        joints = self.robot.joint_positions()
        if not np.isfinite(joints).all():
            raise self._explosion_error(f"joint positions are {joints.tolist()}")
        return joints

    def touch_sensors(self) -> NDArray[np.float64]:
        """The largest normal force on each of the four skins, (4,) newtons."""
        return self.robot.touch_sensors()

    def contacts(self) -> dict[str, list[str]]:
        """What touches the robot: a link's name and, for each point of contact, the other's."""
        names = {self._table: TABLE, **dict(zip(self._bodies, self.object_names, strict=True))}
        touched: dict[str, list[str]] = {}
        for link, body in self.robot.contacts():
            if body in names:
                touched.setdefault(link, []).append(names[body])
        return touched

    def object_poses(self) -> NDArray[np.float64]:
        """Position and quaternion of each object, (n_objects, 7).

        Raises:
            PhysicsError: the world exploded.
        """
        poses = np.array([[*p, *q] for p, q in map(self._pose, self._bodies)])
        if not np.isfinite(poses).all():
            raise self._explosion_error(f"object poses are {poses.tolist()}")
        return poses

    def set_object_poses(self, poses: NDArray[np.float64]) -> None:
        """Put the objects at (n_objects, 7) poses, at rest."""
        if np.shape(poses) != (len(self._bodies), 7):
            objects = counted(len(self._bodies), "object")
            raise SceneError(f"poses of shape {np.shape(poses)} do not fit {objects}")
        self._unwatched_steps = 0
        for body, pose in zip(self._bodies, poses, strict=True):
            pybullet.resetBasePositionAndOrientation(
                body, pose[:3], pose[3:], physicsClientId=self.client
            )

    def image(self) -> Image:
        """What the camera sees now."""
        return self.camera.render()

    def close(self) -> None:
        """Disconnect from physics; may be called more than once."""
        self._end()
        self._client = None

    def __reduce_ex__(self, protocol: SupportsIndex) -> NoReturn:
        """Refuse to be copied or pickled: two objects would share one world."""
        raise SceneError("a simulated world can be neither copied nor pickled: make another one")

    def __enter__(self) -> Simulation:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _pose(self, body: int) -> tuple[tuple[float, ...], tuple[float, ...]]:
        pose: tuple[tuple[float, ...], tuple[float, ...]] = pybullet.getBasePositionAndOrientation(
            body, physicsClientId=self.client
        )
        return pose

    def _watch_objects(self) -> None:
        """Put fallen objects back, and compute for how long nothing else can fall."""
        nearest = np.inf
        for index, body in enumerate(self._bodies):
            (x, _, z), _ = self._pose(body)
            distance = self._distance_to_fall(x, z)
            if not distance >= 0:
                self._put_back(index, z)
                distance = 0.0
            nearest = min(nearest, distance)
        self._unwatched_steps = int(min(nearest / (MAX_OBJECT_SPEED * STEP_S), MAX_UNWATCHED_STEPS))
        self._last_check_at = self.n_steps
        del self._held[:-1]

    def _explosion_error(self, what: str) -> PhysicsError:
        """The error for a world whose poses are no longer numbers.

        Objects are checked now and then, so the error gives the steps in which it happened and the
        commands during them.
        """
        commands = [
            f"{np.round(command, 6).tolist()} from step {step:,} on" for command, step in self._held
        ]
        shown = commands if len(commands) <= SHOWN_COMMANDS else [commands[0], "...", commands[-1]]
        return PhysicsError(
            f"the physics exploded between steps {self._last_check_at:,} and {self.n_steps:,} of "
            f"this world: {what}; the joints were commanded {', '.join(shown) or 'nothing'}"
        )

    def _distance_to_fall(self, x: float, z: float) -> float:
        """How far an object is from counting as fallen, at least; negative when it does."""
        return min((max(z - below, above - x) for below, above in self._fallen), default=np.inf)

    def _put_back(self, index: int, z: float) -> None:
        if z != z:
            raise self._explosion_error(f"{self.object_names[index]} is at z = {z}")
        position, quaternion = self._start_poses[index]
        pybullet.resetBasePositionAndOrientation(
            self._bodies[index], position, quaternion, physicsClientId=self.client
        )
        self.n_put_back += 1

    def _load_table(self) -> None:
        table = self.scene.manifest.table
        self._table = self._load(table.urdf)
        pybullet.resetBasePositionAndOrientation(
            self._table, table.position, (0, 0, 0, 1), physicsClientId=self.client
        )

    def _load_objects(self) -> None:
        specs = self.scene.manifest.objects[: len(self.object_names)]
        self._start_poses = [
            (spec.position, pybullet.getQuaternionFromEuler(spec.euler)) for spec in specs
        ]
        self._bodies = [self._load(spec.urdf) for spec in specs]
        for body, (position, quaternion) in zip(self._bodies, self._start_poses, strict=True):
            pybullet.resetBasePositionAndOrientation(
                body, position, quaternion, physicsClientId=self.client
            )

    def _load(self, urdf: str) -> int:
        return load_body(self.scene, urdf, pybullet.URDF_USE_INERTIA_FROM_FILE, self.client)
