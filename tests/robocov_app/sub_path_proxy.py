"""A reverse proxy that shows a server below a path, like jupyter-server-proxy. It can be slow or fail."""

import socket
import time
from contextlib import suppress
from socketserver import BaseRequestHandler, ThreadingTCPServer
from threading import Thread

PREFIX = "/user/ada/proxy/8765"
HEAD_END = b"\r\n\r\n"
HEAD_BLOCK_BYTES = 1 << 14
BLOCK_BYTES = 1 << 13


class SubPathProxy(ThreadingTCPServer):
    """A proxy for a server on this machine.

    Parameters
    ----------
    port : int
        Port of the server.

    Attributes
    ----------
    bytes_per_s : float
        Maximum rate of the data from the server; 0 stands for no limit.
    connections : list of socket
    """

    daemon_threads = True

    def __init__(self, port: int) -> None:
        super().__init__(("127.0.0.1", 0), _Handler)
        self.server_port = port
        self.bytes_per_s = 0.0
        self.connections: list[socket.socket] = []
        Thread(target=self.serve_forever, daemon=True).start()

    def build_link(self, link: str) -> str:
        """Return the link at which the proxy shows a link of the server."""
        return f"http://127.0.0.1:{self.server_address[1]}{PREFIX}/?{link.partition('?')[2]}"

    def close_connections(self) -> None:
        """Close all connections, as if the network failed."""
        while self.connections:
            with suppress(OSError):
                self.connections.pop().shutdown(socket.SHUT_RDWR)

    def __exit__(self, *_: object) -> None:
        self.close_connections()
        self.shutdown()
        self.server_close()


class _Handler(BaseRequestHandler):
    server: SubPathProxy

    def handle(self) -> None:
        head = b""
        while HEAD_END not in head:
            block = self.request.recv(HEAD_BLOCK_BYTES)
            if not block:
                return
            head += block
        method, path, rest = head.split(b" ", 2)
        if not path.startswith(PREFIX.encode()):
            return
        with socket.create_connection(("127.0.0.1", self.server.server_port)) as upstream:
            self.server.connections += [self.request, upstream]
            upstream.sendall(b" ".join((method, path.removeprefix(PREFIX.encode()), rest)))
            Thread(target=self._forward, args=(self.request, upstream), daemon=True).start()
            self._forward(upstream, self.request, is_limited=True)

    def _forward(self, source: socket.socket, target: socket.socket, *, is_limited: bool = False) -> None:
        """Forward data until the source closes its connection."""
        with suppress(OSError):
            while data := source.recv(BLOCK_BYTES):
                if is_limited and self.server.bytes_per_s:
                    time.sleep(len(data) / self.server.bytes_per_s)
                target.sendall(data)
        with suppress(OSError):
            target.shutdown(socket.SHUT_RDWR)
