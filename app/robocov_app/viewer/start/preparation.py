"""Preparation of the viewer while the start page is shown: its modules are imported, its kernels compiled."""

import importlib
import threading
from contextlib import ExitStack


class Preparation:
    """A thread that imports the viewer, and starts a process that compiles its kernels.

    The other process ends with `close`.
    """

    def __init__(self) -> None:
        self._stack = ExitStack()
        self._error: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name="preparation", daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    @property
    def is_ready(self) -> bool:
        """Whether the viewer can be opened without a delay."""
        return not self._thread.is_alive()

    def finish(self) -> None:
        """Wait for the thread; raise the exception that has ended it, if any."""
        self._thread.join()
        if self._error is not None:
            raise self._error

    def close(self) -> None:
        """End the process that compiles."""
        if self._thread.ident is not None:
            self._thread.join()
        self._stack.close()

    def _run(self) -> None:
        try:
            from robocov.kernel_compilation import compile_in_background

            self._stack.enter_context(compile_in_background())
            importlib.import_module("robocov_app.viewer.launch")
        except BaseException as error:
            self._error = error
