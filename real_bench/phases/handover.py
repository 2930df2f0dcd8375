"""What a controller gets back from its own play before it is tested: state and files."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from real_bench.conditions import Condition
from real_bench.controller_code.source import (
    ControllerSource,
    has_code_hash,
    recorded_name,
    resolved,
)
from real_bench.errors import ControllerError
from real_bench.phases.proxy import Identity
from real_bench.recording import ControllerState, Header, Recording
from real_bench.scoring.result import Learned
from real_bench.settings import dotted
from real_bench.text.naming import without_folder

log = logging.getLogger(__name__)

Wanted = Literal["keep", "again", "nothing"]
"""What to do in doubt: use what was learned with other code or settings (``keep``), learn again
from the recording (``again``), or go on with nothing learned at all, which is for controllers that
cannot learn from recordings."""


@dataclass(frozen=True)
class Handover:
    """What a controller continues from.

    Attributes:
        state, files: as it left them; empty if it left nothing, or must not get it.
        learned: the code and settings that made the state; None if there is no state.
    """

    state: ControllerState = field(default_factory=dict)
    files: Mapping[str, bytes] = field(default_factory=dict)
    learned: Learned | None = None


NOTHING = Handover()


def load_handover(
    run: Path,
    controller: str,
    identity: Identity,
    condition: Condition,
    wanted: Wanted | None,
    steps: int | None = None,
) -> Handover:
    """What a recording holds for a controller; nothing if another one played.

    Args:
        run: the recording.
        controller: what the user names it by.
        identity: what the controller is now.
        condition: of the test.
        wanted: what to do where the recording alone does not say.
        steps: how many of its first steps are learned from; None: all. What was learned at play
            came from all of them, so it is not for a test after a part.

    Raises:
        ControllerError: it is unclear what to do; the message names the options.
        RecordingError: what was learned may not serve in this condition.
    """
    if wanted == "nothing" and identity.learns_from_experience:
        raise ControllerError(
            f"controller {controller} learns from {run} (use_experience), so it is never tested as "
            "made: leave out --as-made"
        )
    with Recording(run) as recording:
        header = recording.header
        if not _may_continue(header, controller, identity):
            if wanted is None and not identity.learns_from_experience:
                log.warning(
                    "controller %s does not learn from recordings (it has no use_experience()): "
                    "another one played %s, so it is tested as made",
                    controller,
                    run,
                )
            return NOTHING
        if steps is not None and steps < recording.n_steps:
            _check_learns_from_a_part(run, controller, identity, wanted)
            return NOTHING
        header.check_state_is_allowed(condition)
        state, files = recording.controller_state(), recording.controller_files()
        code = recording.code_sha256
    if not (state or files):
        _check_nothing_is_lost(run, controller, identity, wanted)
        return NOTHING
    if wanted == "nothing":
        raise ControllerError(
            f"controller {controller}: {run} holds what it learned: leave out --as-made"
        )
    if wanted == "again":
        if not identity.learns_from_experience:
            raise ControllerError(
                f"controller {controller} cannot learn from a recording again: it has no "
                "use_experience()"
            )
        return NOTHING
    changes = list(_changes(header, code, controller, identity))
    if changes and wanted is None:
        raise ControllerError(
            f"controller {controller}: what it learned in {run} was learned with different "
            f"{'; different '.join(changes)}: use --keep-learned to keep it, or --relearn to "
            "learn again from the recording"
        )
    return Handover(state, files, Learned(code_sha256=code, settings=header.settings))


def _may_continue(header: Header, controller: str, identity: Identity) -> bool:
    """Whether what was learned may be this controller's.

    One that was moved and edited is told by its file's name and its class. If it can learn from the
    recording it does that; otherwise it would be tested untrained, and nobody would notice.
    """
    if header.was_made_by(resolved(controller), identity.code_sha256, identity.class_name):
        return True
    named = without_folder(header.controller), header.controller_class
    alike = named == (without_folder(recorded_name(controller)), identity.class_name)
    return alike and not identity.learns_from_experience


def _check_nothing_is_lost(
    run: Path, controller: str, identity: Identity, wanted: Wanted | None
) -> None:
    """Refuse to test a controller without what it learned at play, unless that is wanted."""
    if wanted is None and not identity.learns_from_experience:
        raise ControllerError(
            f"controller {controller}: {run} does not hold what it learned, since it has no "
            "get_state(). Play and test it in one process (realbench evaluate), define "
            "get_state() and set_state(), or test it untrained with --as-made"
        )


def _check_learns_from_a_part(
    run: Path, controller: str, identity: Identity, wanted: Wanted | None
) -> None:
    """Refuse a part of a play to a controller that cannot learn from it, unless that is wanted."""
    if wanted == "keep":
        raise ControllerError(
            f"controller {controller}: what it learned in {run} came from all of its steps: leave "
            "out --keep-learned or --run-steps"
        )
    if wanted != "nothing" and not identity.learns_from_experience:
        raise ControllerError(
            f"controller {controller} cannot learn from a part of {run}: it has no "
            "use_experience(). Leave out --run-steps, or test it untrained with --as-made"
        )


def _changes(header: Header, code: str, controller: str, identity: Identity) -> Iterator[str]:
    if not has_code_hash(ControllerSource.of(controller), code):
        yield "code"
    before, now = dict(dotted(header.settings)), dict(dotted(identity.settings))
    changed = [
        f"{name}={before.get(name)}, now {now.get(name)}"
        for name in sorted({*before, *now})
        if before.get(name) != now.get(name)
    ]
    if changed:
        yield f"settings ({'; '.join(changed)})"
