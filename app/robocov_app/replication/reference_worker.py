"""The process that searches for references: ``python -m robocov_app.replication.reference_worker``.

It ends when nobody is there any more who could ask, also in the midst of a search.
"""

from __future__ import annotations

import os
import queue
import threading
from contextlib import suppress
from typing import TYPE_CHECKING, BinaryIO

from robocov_app.live.own_process import own_streams

if TYPE_CHECKING:
    from robocov_app.replication.references import Question


def main() -> None:
    """Answer questions until there are no more."""
    source, target = own_streams()
    from robocov.errors import OutputError, RobocovError
    from robocov_app.live.messages import send
    from robocov_app.replication.references import answered

    inbox: queue.SimpleQueue[Question] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(source, inbox), daemon=True).start()
    with suppress(OSError):  # nobody may be there any more
        while True:
            question = inbox.get()
            try:
                answer: object = answered(question)
            except RobocovError as error:
                answer = OutputError(f"reference of map {question.document.get('name')!r}: {error}")
            send(target, answer)


def _listen(source: BinaryIO, inbox: queue.SimpleQueue[Question]) -> None:
    from robocov_app.live.messages import receive

    while (question := receive(source)) is not None:
        inbox.put(question)
    os._exit(0)


if __name__ == "__main__":
    main()
