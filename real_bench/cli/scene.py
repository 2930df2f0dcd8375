"""``realbench scene``."""

from __future__ import annotations

from pathlib import Path

import click

from real_bench.cli import options
from real_bench.cli.common import HelpfulGroup
from real_bench.cli.printing import say

INSTALL_EPILOG = """\b
Example:
  realbench scene install
  realbench scene install --from real_robots-0.1.21-py2.py3-none-any.whl
"""


@click.group(cls=HelpfulGroup)
def scene() -> None:
    """Install and list scenes."""


@scene.command(epilog=INSTALL_EPILOG)
@click.argument("name", default="official")
@click.option(
    "--from", "wheel", type=options.FILE, help="Use this wheel instead of downloading it with pip."
)
def install(name: str, wheel: Path | None) -> None:
    """Install the files of a scene (by default official, 9 MB) for this user.

    Only data is unpacked from the wheel, after its checksum is verified; none of its code is
    installed or run.
    """
    from real_bench.simulation.install import install_scene
    from real_bench.simulation.scene import load_scene, manifest_path, read_manifest

    manifest = read_manifest(manifest_path(name))
    folder = install_scene(manifest, wheel)
    say(f"scene {manifest.name} is in {folder} (hash {load_scene(name).sha256[:12]})")


@scene.command(name="list", epilog="\b\nExample:\n  realbench scene list\n")
def list_scenes() -> None:
    """List the scenes that ship with realbench, and whether they are ready."""
    from real_bench.errors import SceneError
    from real_bench.simulation.scene import load_scene, shipped_scenes

    for name in shipped_scenes():
        try:
            say(f"{name}: ready (hash {load_scene(name).sha256[:12]})")
        except SceneError as error:
            say(f"{name}: {error}")
