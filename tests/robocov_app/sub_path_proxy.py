"""A reverse proxy that shows a server below a path, as jupyter-server-proxy does; slow, or cut, if wanted."""

import socket
import time
from contextlib import suppress
from socketserver import BaseRequestHandler, ThreadingTCPServer
from threading import Thread
from typing import Any

PREFIX = "/user/ada/proxy/8765"


class SubPathProxy(ThreadingTCPServer):
    daemon_threads = True

    def __init__(self, port: int) -> None:
        super().__init__(("127.0.0.1", 0), _Handler)
        self.behind = port
        self.rate = 0.0
        self.lines = list[Any]()
        Thread(target=self.serve_forever, daemon=True).start()

    def link(self, link: str) -> str:
        """Return where this shows a link of the server behind."""
        return f"http://127.0.0.1:{self.server_address[1]}{PREFIX}/?{link.partition('?')[2]}"

    def cut(self) -> None:
        while self.lines:
            with suppress(OSError):
                self.lines.pop().shutdown(socket.SHUT_RDWR)

    def __exit__(self, *_: object) -> None:
        self.cut()
        self.shutdown()
        self.server_close()


class _Handler(BaseRequestHandler):
    server: SubPathProxy

    def handle(self) -> None:
        head = b""
        while b"\r\n\r\n" not in head:
            if not (more := self.request.recv(1 << 14)):
                return
            head += more
        kind, path, rest = head.split(b" ", 2)
        if not path.startswith(PREFIX.encode()):
            return
        with socket.create_connection(("127.0.0.1", self.server.behind)) as behind:
            self.server.lines += self.request, behind
            behind.sendall(b" ".join((kind, path.removeprefix(PREFIX.encode()), rest)))
            Thread(target=self._carry, args=(self.request, behind, False), daemon=True).start()
            self._carry(behind, self.request, True)

    def _carry(self, source: socket.socket, to: socket.socket, down: bool) -> None:
        with suppress(OSError):
            while data := source.recv(1 << 13):
                if down and self.server.rate:
                    time.sleep(len(data) / self.server.rate)  # bytes a second
                to.sendall(data)
        with suppress(OSError):
            to.shutdown(socket.SHUT_RDWR)
