"""What reaches the server of a live view: requests for its own page, and messages of that page.

The server of viser takes any message of any page that is open in the user's browser, and sets
whatever attribute a message names.
"""

import ipaddress
import socket
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http import HTTPStatus
from typing import Any
from urllib.parse import urlsplit

FAR = 1e9
"""Largest number in a message; the sizes of scenes are in m."""

LARGEST = 1 << 16
"""Bytes of a message above which its connection is closed; the page sends less than 1000."""

CAMERA = {"wxyz": 4, "position": 3, "look_at": 3, "up_direction": 3, "fov": 0, "near": 0, "far": 0,
          "image_height": 0, "image_width": 0}  # fmt: skip
"""Numbers of a camera and the lengths of its lists."""

CLOSED = "This page opens only at an address or a name of the computer that serves it.\n"


class Gate:
    """Lets in what the page itself sends, and ignores everything else.

    Parameters
    ----------
    host : str
        Address on which the server listens.

    Attributes
    ----------
    inputs : dict of str to callable
        Whether an input, by viser's identifier, may have a value.
    """

    def __init__(self, host: str) -> None:
        self.inputs: dict[str, Callable[[Any], bool]] = {}
        own = socket.gethostname().lower()
        self._names = {"localhost", own, f"{own}.local", socket.getfqdn().lower(), host.lower()}
        self._reported = False

    @contextmanager
    def around_servers(self) -> Iterator[None]:
        """Put the gate in front of each server that viser starts during the block."""
        from websockets.asyncio import server

        gate, serve = self, server.serve

        class Connection(server.ServerConnection):
            async def recv(self, decode: bool | None = None) -> Any:
                while not gate.admits(message := await super().recv(decode)):
                    gate.report()
                return message

        def guarded(*arguments: Any, process_request: Any, **options: Any) -> Any:
            def respond(connection: Any, request: Any) -> Any:
                if not gate.is_own(request.headers):
                    return connection.respond(HTTPStatus.FORBIDDEN, CLOSED)
                return process_request(connection, request)

            options |= {"max_size": LARGEST, "create_connection": Connection}
            return serve(*arguments, process_request=respond, **options)

        server.serve = guarded
        try:
            yield
        finally:
            server.serve = serve

    def is_own(self, headers: Any) -> bool:
        """Whether a request is for a name of this computer, and not from another site's page.

        A site whose name its owner lets lead here (DNS rebinding) is another name.
        """
        hosts, origins = headers.get_all("Host"), headers.get_all("Origin")
        try:
            if len(hosts) != 1 or any(urlsplit(origin).netloc != hosts[0] for origin in origins):
                return False
            name = urlsplit(f"//{hosts[0]}").hostname or ""
        except ValueError:
            return False
        return name in self._names or _is_address(name)

    def admits(self, message: Any) -> bool:
        """Whether a message moves the camera or sets an input to a value that it may have."""
        import msgspec

        try:
            match msgspec.msgpack.decode(message):
                case {"type": "ViewerCameraMessage", **camera}:
                    return (
                        camera.keys() == CAMERA.keys()
                        and all(_are_numbers(camera[name], n) for name, n in CAMERA.items())
                        and min(camera["image_height"], camera["image_width"]) > 0
                    )
                case {
                    "type": "GuiUpdateMessage",
                    "uuid": str(one),
                    "updates": {"value": value, **others},
                }:
                    return not others and one in self.inputs and self.inputs[one](value)
        except (msgspec.DecodeError, RecursionError, TypeError, ValueError):
            pass
        return False

    def report(self) -> None:
        """Say once that messages are ignored."""
        if not self._reported:
            self._reported = True
            print(
                "magmotor: the live view ignores a message that its page does not send",
                file=sys.stderr,
            )


def is_number(value: Any) -> bool:
    """Whether a value is a number that is not absurdly large."""
    return type(value) in (int, float) and abs(value) <= FAR


def _are_numbers(value: Any, length: int) -> bool:
    """Whether a value is a list of so many numbers, or, for length 0, one number."""
    if not length:
        return is_number(value)
    return isinstance(value, list) and len(value) == length and all(map(is_number, value))


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True
