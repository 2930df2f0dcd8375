"""pybullet, imported without the line that it prints about its build."""

from __future__ import annotations

import os


def _import_quietly() -> None:
    kept = os.dup(2)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        import pybullet  # noqa: F401
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)


_import_quietly()

import pybullet  # noqa: E402

__all__ = ["pybullet"]
