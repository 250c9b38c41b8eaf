"""A page of a served window without a browser: it sends input, and decodes the frames that it receives."""

import json
import time
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from robocov_app.web.frames import HEADER

MAX_WAIT_S = 120.0
"""Maximum time to wait for the server, which may have to compile kernels first."""
POLL_INTERVAL_S = 0.02
UPLOAD_PIECE_BYTES = 1 << 17


def wait_until(condition: Callable[[], object]) -> None:
    """Wait until a condition is true."""
    deadline = time.monotonic() + MAX_WAIT_S
    while not condition():
        assert time.monotonic() < deadline, f"the condition was not met within {MAX_WAIT_S:g} s"
        time.sleep(POLL_INTERVAL_S)


def decode_frame(data: bytes, previous: NDArray[np.uint32] | None) -> NDArray[np.uint32]:
    """Return the image that a page shows after a frame, as its script computes it.

    Parameters
    ----------
    data : bytes
        The encoded frame.
    previous : (height, width) array of uint32 or None
        The image that the page showed before.
    """
    _, width, height, left, top, box_width, box_height, starts_from_black = HEADER.unpack_from(data)
    image = np.zeros((height, width), np.uint32)
    has_same_size = previous is not None and previous.shape == image.shape
    if has_same_size and not starts_from_black:
        image = previous.copy()
    box = np.frombuffer(zlib.decompress(data[HEADER.size :]), np.uint32).reshape(box_height, box_width)
    image[top : top + box_height, left : left + box_width] ^= box
    return image


def find_controller(state: dict[str, Any]) -> int | None:
    """Return the number of the participant who controls the window; None if there is none."""
    for participant in state["participants"]:
        if participant["controls"]:
            return participant["number"]
    return None


class PageClient:
    """A page that is connected to a served window.

    Parameters
    ----------
    socket : websockets.sync.client.ClientConnection

    Attributes
    ----------
    image : (height, width) array of uint32 or None
        Displayed image; None before the first frame.
    """

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.image: NDArray[np.uint32] | None = None

    # Input

    def send(self, **message: object) -> None:
        """Send a message, such as ``send(kind="blur")``."""
        self.socket.send(json.dumps(message))

    def report_page(self, width: int, height: int, **settings: object) -> None:
        """Report the size of the page, px, and optionally its other settings."""
        defaults = {"ratio": 1.0, "dark": False}
        self.send(kind="page", width=width, height=height, **{**defaults, **settings})

    def press_key(self, key: str, held: int = 0) -> None:
        """Press and release a key while modifier keys are held."""
        for is_down in (True, False):
            self.send(kind="key", key=key, down=is_down, held=held)

    def drag(self, *points: tuple[float, float]) -> None:
        """Press the left mouse button at the first point, move along the others, and release it."""
        x, y = points[0]
        self.send(kind="button", button=1, down=True, x=x, y=y)
        for x, y in points:
            self.send(kind="move", button=1, x=x, y=y)
        self.send(kind="button", button=1, down=False, x=x, y=y)

    def pass_control(self, number: int) -> None:
        """Pass control to a participant."""
        self.send(kind="control", to=number)

    def request_control(self) -> None:
        self.send(kind="control", to=0)

    def upload(self, name: str, content: bytes) -> None:
        """Upload a file in pieces."""
        self.send(kind="upload", name=name, size=len(content))
        for start in range(0, len(content), UPLOAD_PIECE_BYTES):
            self.socket.send(content[start : start + UPLOAD_PIECE_BYTES])

    # Output of the server

    def receive_message(self) -> dict[str, Any]:
        """Return the next message other than a frame."""
        while True:
            data = self.socket.recv(MAX_WAIT_S)
            if isinstance(data, str):
                return json.loads(data)

    def receive_message_until(self, condition: Callable[[dict[str, Any]], object]) -> dict[str, Any]:
        """Return the next message that fulfils a condition."""
        while True:
            message = self.receive_message()
            if condition(message):
                return message

    def receive_notice(self) -> str:
        """Return the text of the next notice to the user."""
        return self.receive_message_until(lambda message: message["kind"] == "notice")["text"]

    def receive_frame(self) -> NDArray[np.uint32]:
        """Show and confirm the next frame, and return the image."""
        while True:
            data = self.socket.recv(MAX_WAIT_S)
            if isinstance(data, bytes):
                break
        self.image = decode_frame(data, self.image)
        self.send(kind="shown", number=HEADER.unpack_from(data)[0])
        return self.image

    def wait_for_close(self) -> tuple[int, str] | None:
        """Return the code and the reason with which the server closes the connection.

        None if the connection ends without a closing handshake.
        """
        while True:
            try:
                self.socket.recv(MAX_WAIT_S)
            except ConnectionClosed as closed:
                received = closed.rcvd
                break
        if received is None:
            return None
        return received.code, received.reason


def build_socket_address(link: str) -> str:
    """Return the address of the socket that the page of a link opens."""
    return link.replace("http", "ws", 1).replace("/?", "/socket?")


@contextmanager
def connect_page(link: str, *, page_id: str = "") -> Iterator[PageClient]:
    """Connect a page to the window of a link, without loading the page itself.

    Parameters
    ----------
    link : str
        Link for controlling or for watching, with its token.
    page_id : str
        Identity of the page. A page that has lost its connection comes back with the same one.
    """
    address = build_socket_address(link)
    if page_id:
        address += f"&page={page_id}"
    with connect(address, proxy=None, max_size=None) as socket:
        yield PageClient(socket)
