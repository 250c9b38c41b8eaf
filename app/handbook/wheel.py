"""Build hook: adds the built handbook to a wheel if its requirements are installed."""

import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class HandbookHook(BuildHookInterface[Any]):
    """Adds the pages as ``robocov_app/pages``.

    The isolated builds of pip do not have the requirements, and therefore take no longer than without pages.
    """

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Build the pages from the source of the wheel."""
        if version == "editable" or not all(map(find_spec, ("sphinx", "furo", "myst_parser", "numpy"))):
            return
        self._folder = TemporaryDirectory()
        pages = Path(self._folder.name, "pages")
        roots = os.pathsep.join(str(Path(self.root, name)) for name in ("app", "coverage"))
        call = [sys.executable, "-m", "robocov_app", "handbook", "--out", str(pages)]
        subprocess.run(call, check=True, stdout=sys.stderr, env={**os.environ, "PYTHONPATH": roots})
        build_data["force_include"][str(pages)] = "robocov_app/pages"

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Remove the temporary pages."""
        if hasattr(self, "_folder"):
            self._folder.cleanup()
