"""Where isolated controllers run: a process each, in a sandbox."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from real_bench.controller_code.requirements import packages_of
from real_bench.controller_code.source import ControllerSource, resolved
from real_bench.errors import BrokenRuleError, ControllerError
from real_bench.phases.proxy import NO_FILES, Identity
from real_bench.sandbox.limits import Limits
from real_bench.sandbox.messages import MessageError, encode
from real_bench.sandbox.proxy import SandboxProxy, put_files
from real_bench.sandbox.rpc_client import RpcClient
from real_bench.sandbox.support import SandboxSupport, sandbox_support
from real_bench.sandbox.visible_files import visible_files
from real_bench.task import Task
from real_bench.text.quoting import printable


@dataclass(frozen=True)
class SandboxBackend:
    """Runs each controller in a process of its own; only that process imports it.

    Attributes:
        secrets: files and folders that must not be readable for a controller.
        limits: what it may use up.
        support: what is enforced.
    """

    secrets: tuple[Path, ...] = ()
    limits: Limits = field(default_factory=Limits)
    support: SandboxSupport = field(default_factory=sandbox_support)

    def identity(self, spec: str, settings: Mapping[str, Any] | None) -> Identity:
        """What the controller is; raises ControllerError."""
        source = ControllerSource.of(spec)
        client = self._start_client(source)
        try:
            return _identity(client, source, settings)
        finally:
            client.close()

    def proxy(
        self,
        spec: str,
        settings: Mapping[str, Any],
        task: Task,
        files: Mapping[str, bytes] = NO_FILES,
    ) -> SandboxProxy:
        """The controller, made; raises ControllerError."""
        source = ControllerSource.of(spec)
        client = self._start_client(source)
        try:
            put_files(client, files)
            identity = _identity(client, source, settings)
            scene = task.simulation.scene
            manifest = scene.manifest.model_dump(exclude_defaults=True)
            n_objects = len(task.simulation.object_names)
            client.ask("make", manifest, task.condition.name, n_objects)
        except BaseException:
            client.close()
            raise
        return SandboxProxy(spec, identity, task.control, client)

    def _start_client(self, source: ControllerSource) -> RpcClient:
        packages = None if source.submission is None else packages_of(source.submission)
        visible = visible_files(source, self.secrets, packages)
        visible.check_hides(self.secrets)
        return RpcClient(source.spec, visible, self.limits, self.support)


def _identity(
    client: RpcClient, source: ControllerSource, settings: Mapping[str, Any] | None
) -> Identity:
    try:
        encode(settings)
    except MessageError as error:
        text = f"its settings must be plain values: {error}"
        raise client.fault(text, ControllerError) from error
    match client.ask("identity", source.spec, resolved(source.spec), settings):
        case {
            "class_name": str(name),
            "file": str(file),
            "action_level": bool(action_level),
            "uses_images": bool(uses_images),
            "learns_across_trials": bool(learns_across_trials),
            "learns_from_experience": bool(learns_from_experience),
            "hands_over_state": bool(hands_over_state),
            "takes_state": bool(takes_state),
            "settings": dict(settings),
            "misspelt": list(misspelt),
        } if _survives_json(settings):
            return Identity(
                class_name=printable(name[:200]),
                file=printable(file[:1000]),
                code_sha256=source.code_sha256,
                action_level=action_level,
                uses_images=uses_images,
                learns_across_trials=learns_across_trials,
                learns_from_experience=learns_from_experience,
                hands_over_state=hands_over_state,
                takes_state=takes_state,
                settings=settings,
                misspelt=tuple(printable(str(each))[:200] for each in misspelt[:10]),
            )
    raise client.fault("its process did not describe the controller", BrokenRuleError)


def _survives_json(values: dict[Any, Any]) -> bool:
    """Whether files keep values as they are; a child sends arrays, too."""
    try:
        return bool(json.loads(json.dumps(values, allow_nan=False)) == values)
    except (TypeError, ValueError):
        return False
