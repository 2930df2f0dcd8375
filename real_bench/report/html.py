"""Pages from templates: whatever text stands in them, it is escaped and printable."""

from __future__ import annotations

from importlib.resources import files

from real_bench.text.quoting import printable
from real_bench.version import __version__


def packaged_text(package: str, name: str) -> str:
    """A text file that lies in a package: a template, a style sheet, a script."""
    return (files(package) / name).read_text(encoding="utf-8")


def render_html(template: str, **values: object) -> str:
    """A page with the values that its template names, the report's script and our version."""
    from jinja2 import Environment, StrictUndefined

    page = Environment(
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        finalize=lambda value: printable(value) if type(value) is str else value,
    ).from_string(template)
    script = packaged_text(__package__, "page.js")
    return page.render(script=script, version=__version__, **values)
