"""Where isolated controllers run: a process each, within walls."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from real_bench.errors import ControllerError
from real_bench.isolation.conversation import Conversation
from real_bench.isolation.guest import IsolatedGuest, put_files
from real_bench.isolation.limits import Limits
from real_bench.isolation.messages import MessageError, encode
from real_bench.isolation.process import printable
from real_bench.isolation.view import view_of
from real_bench.isolation.walls import Walls, found_walls
from real_bench.phases.guest import NO_FILES, Identity
from real_bench.source import ControllerSource, resolved
from real_bench.task import Task


@dataclass(frozen=True)
class IsolatedHost:
    """Has each controller in a process of its own, which alone imports it.

    Attributes:
        secrets: files and folders that must not lie where a controller may read.
        limits: what it may use up.
        walls: what is enforced.
    """

    secrets: tuple[Path, ...] = ()
    limits: Limits = field(default_factory=Limits)
    walls: Walls = field(default_factory=found_walls)

    def identity(self, spec: str, settings: Mapping[str, Any] | None) -> Identity:
        """What the controller is; raises ControllerError."""
        source = ControllerSource.of(spec)
        conversation = self._begun(source)
        try:
            return _identity(conversation, source, settings)
        finally:
            conversation.close()

    def guest(
        self,
        spec: str,
        settings: Mapping[str, Any],
        task: Task,
        files: Mapping[str, bytes] = NO_FILES,
    ) -> IsolatedGuest:
        """The controller, made; raises ControllerError."""
        source = ControllerSource.of(spec)
        conversation = self._begun(source)
        try:
            put_files(conversation, files)
            identity = _identity(conversation, source, settings)
            scene = task.simulation.scene
            manifest = scene.manifest.model_dump(exclude_defaults=True)
            n_objects = len(task.simulation.object_names)
            conversation.ask("make", manifest, task.condition.name, n_objects)
        except BaseException:
            conversation.close()
            raise
        return IsolatedGuest(spec, identity, task.control, conversation)

    def _begun(self, source: ControllerSource) -> Conversation:
        view = view_of(source)
        view.check_hides(self.secrets)
        return Conversation(source.spec, view, self.limits, self.walls)


def _identity(
    conversation: Conversation, source: ControllerSource, settings: Mapping[str, Any] | None
) -> Identity:
    try:
        encode(settings)
    except MessageError as error:
        raise conversation.fault(f"its settings must be plain values: {error}") from error
    match conversation.ask("identity", source.spec, resolved(source.spec), settings):
        case {
            "class_name": str(name),
            "file": str(file),
            "action_level": bool(action_level),
            "uses_images": bool(uses_images),
            "learns_across_trials": bool(learns_across_trials),
            "learns_from_experience": bool(learns_from_experience),
            "hands_over_state": bool(hands_over_state),
            "settings": dict(settings),
        }:
            return Identity(
                class_name=name[:200],
                file=printable(file[:1000]),
                code_sha256=source.code_sha256,
                action_level=action_level,
                uses_images=uses_images,
                learns_across_trials=learns_across_trials,
                learns_from_experience=learns_from_experience,
                hands_over_state=hands_over_state,
                settings=settings,
            )
    raise ControllerError(f"controller {source.spec}: its process does not say what it is")
