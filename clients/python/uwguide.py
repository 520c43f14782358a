"""Client of the guidance daemon `uwguide`; Python 3.9 or newer, no dependencies.

Units are in the names: depth_m and distance_m in m, light_pct in percent of full intensity, mean and std
per channel (R, G, B) in 8-bit counts.
"""

import json
import socket
import ssl as _ssl
from typing import Any, Dict, Iterator, List, Optional, Sequence, Tuple, Union

__all__ = ["Client", "Refused"]

DEFAULT_HOST = "127.0.0.1"
DEFAULT_PORT = 7475
MAX_LINE_BYTES = 1 << 20


class Refused(Exception):
    """The daemon refused a request; `code`, `field` and `reason` are those of the reply."""

    def __init__(self, reply: Dict[str, Any]):
        error = reply.get("error") or {}
        super().__init__(error.get("message", "no message"))
        self.code: Optional[str] = error.get("code")
        self.field: Optional[str] = error.get("field")
        self.reason: Optional[str] = reply.get("reason")


class Client:
    """One connection; use it in a `with` statement, from one thread."""

    def __init__(
        self,
        address: Optional[str] = None,
        token: Union[str, int, None] = None,
        timeout_s: float = 5.0,
        ssl: Optional[_ssl.SSLContext] = None,
        *,
        host: Optional[str] = None,
        port: Optional[int] = None,
    ):
        """Connects to HOST:PORT or unix:PATH, or to a host and a port, as in `Client("127.0.0.1", 7475)`: a whole number behind the
        host is its port, and the token then goes by its name. `timeout_s` bounds every wait for the daemon, which closes a
        connection that asks nothing within 10 s."""
        if isinstance(token, int):
            token, port = None, token
        if host is None and port is not None:
            host, address = address, None
        if address is None:
            host, port = host or DEFAULT_HOST, DEFAULT_PORT if port is None else port
            address = f"[{host}]:{port}" if ":" in host else f"{host}:{port}"
        if address.startswith("unix:"):
            self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
            self._socket.settimeout(timeout_s)
            self._socket.connect(address[len("unix:"):])
        else:
            host, _, service = address.rpartition(":")
            host = host.strip("[]")
            self._socket = socket.create_connection((host, int(service)), timeout=timeout_s)
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            if ssl is not None:
                self._socket = ssl.wrap_socket(self._socket, server_hostname=host)
        self._lines = self._socket.makefile("rb")
        self._last_id = 0
        self._pushed: List[Dict[str, Any]] = []
        if token is not None:
            self.request("auth", token=token)

    def __enter__(self) -> "Client":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Closes the connection."""
        self._lines.close()
        self._socket.close()

    def request(self, op: str, **fields: Any) -> Dict[str, Any]:
        """Sends a request of the protocol and waits for its reply; `Refused` when it is an error."""
        self._last_id += 1
        number = self._last_id
        line = json.dumps({"op": op, "id": number, **fields}, allow_nan=False).encode() + b"\n"
        if len(line) > MAX_LINE_BYTES:
            raise ValueError(f"a request must be at most {MAX_LINE_BYTES} bytes long, got {len(line)}")
        self._socket.sendall(line)
        while True:
            reply = self._receive()
            if reply.get("push"):
                self._pushed.append(reply)
            elif reply.get("ok") is not True:
                raise Refused(reply)
            elif reply.get("id") == number:
                return reply

    def _receive(self) -> Dict[str, Any]:
        line = self._lines.readline()
        if not line.endswith(b"\n"):
            raise ConnectionError("the daemon closed the connection")
        reply: Dict[str, Any] = json.loads(line)
        return reply

    def suggest(self, **state: Any) -> Dict[str, Any]:
        """The best distance and lamp level. What is not given comes from the latest state; act only when
        `valid` is true and `action` is "move". With `mean` and `std` give the size of their picture too, `width` and
        `height` in pixels: contrast depends on it, and the daemon refuses what its model was not made for. Where you know
        them, `std_corrected`, `noise_floor` and `saturated` (of `uw stats --json`, where the first is
        `contrast_corrected`) tell it whether the picture shows more than noise.
        `why` says in words what was found, `warnings` what is to be taken with care."""
        return self.request("suggest", **state)

    def suggest_image(self, path: str, **state: Any) -> Dict[str, Any]:
        """The same with the statistics measured from an image file on the daemon's machine, under the
        directory that its configuration names (`images.directory`)."""
        return self.request("suggest_image", image={"path": path}, **state)

    def predict(self, candidates: Sequence[Tuple[float, float]], **state: Any) -> Dict[str, Any]:
        """Contrast and score of pairs (distance_m, light_pct)."""
        return self.request("predict", candidates=[list(pair) for pair in candidates], **state)

    def state(self, **state: Any) -> Dict[str, Any]:
        """Feeds any part of the vehicle's state, for all connections."""
        return self.request("state", **state)

    def subscribe(self, rate_hz: float, **fields: Any) -> Iterator[Dict[str, Any]]:
        """Suggestions from the latest state at a rate, with hysteresis and rate limits, for ever."""
        self.request("subscribe", rate_hz=rate_hz, **fields)
        while True:
            reply = self._pushed.pop(0) if self._pushed else self._receive()
            if reply.get("push"):
                yield reply

    def info(self) -> Dict[str, Any]:
        """Model, profile and objective in use."""
        return self.request("info")

    def health(self) -> Dict[str, Any]:
        """Whether and how long the daemon runs."""
        return self.request("health")
