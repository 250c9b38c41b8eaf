"""Import of optional dependencies, which ``pip install robocov`` does not install."""

import importlib
from typing import Any

from robocov.errors import RobocovError


def import_optional(module: str, extra: str, prefix: str = "") -> Any:
    """Import a module of an optional dependency.

    Parameters
    ----------
    module : str
        Full name of the module.
    extra : str
        Name of the extra, as in ``pip install "robocov[extra]"``, that installs it.
    prefix : str
        Beginning of the error message, such as ``"--parquet: "``.

    Returns
    -------
    module

    Raises
    ------
    RobocovError
        If the dependency is not installed.

    Examples
    --------
    >>> import_optional("json", "any").dumps([1, 2])
    '[1, 2]'
    """
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        package = module.partition(".")[0]
        if error.name != package:
            raise  # The package is installed, but one of its own dependencies is missing.
        raise RobocovError(f'{prefix}{module} is not installed: pip install "robocov[{extra}]"') from error
