"""Small vector files for tests of importers."""

import json
from pathlib import Path
from typing import Any

from robocov_app.formats import IMPORTERS, ForeignMap, ReadOptions


def read(folder: Path, kind: str, content: Any, **options: Any) -> ForeignMap:
    """Write text, bytes, or a JSON value to a file of a format, and import the file."""
    importer = IMPORTERS[kind]
    path = folder / f"plan{importer.suffixes[0]}"
    if isinstance(content, bytes):
        path.write_bytes(content)
    else:
        path.write_text(content if isinstance(content, str) else json.dumps(content), encoding="utf-8")
    assert importer.sniff(path, path.read_bytes())
    return importer.read(path, ReadOptions(**options))


def build_square(x: float, y: float, width: float, height: float) -> list[list[float]]:
    """Return a closed ring."""
    return [[x, y], [x + width, y], [x + width, y + height], [x, y + height], [x, y]]


def build_svg(body: str, head: str = 'width="1000" height="600"') -> str:
    """Return an SVG document."""
    return f'<svg xmlns="http://www.w3.org/2000/svg" {head}>{body}</svg>'
