"""What a controller is called."""

from __future__ import annotations

from pathlib import Path


def shown_name(controller: str) -> str:
    """A controller's name as the paper writes it; of one in a file its class, or the file."""
    target, _, class_name = controller.partition(":")
    if class_name:
        return class_name
    if target.endswith(".py"):
        return Path(target).stem
    return target.upper().replace("_", "-") if target.startswith("real_") else target
