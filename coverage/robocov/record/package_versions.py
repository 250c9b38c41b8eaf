"""Versions of the packages on which a result depends."""

from __future__ import annotations

import platform
from collections.abc import Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from types import MappingProxyType

_PACKAGES = ("robocov", "numpy", "scipy", "shapely", "pymunk")
"""Distribution names of the packages, apart from Python itself."""


@cache
def list_versions() -> Mapping[str, str]:
    """Return the versions of Python and of the packages on which a result depends.

    Returns
    -------
    mapping of str to str
        Version by name of the package, read-only; "unknown" for a package that is not installed.
    """
    versions = {"python": platform.python_version()}
    for package in _PACKAGES:
        try:
            versions[package] = version(package)
        except PackageNotFoundError:
            versions[package] = "unknown"
    return MappingProxyType(versions)
