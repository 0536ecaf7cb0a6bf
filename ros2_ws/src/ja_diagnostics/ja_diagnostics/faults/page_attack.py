"""What another site, and foreign messages, do to the live page of a running graph."""

import http.client
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

from sensor_msgs.msg import JointState

from ja_common.core.live_page import LIVE_PAGE
from ja_common.topics import JOINT_STATES
from ja_diagnostics.faults.relay import Relay

_PATIENCE_S = 5.0
_SOCKET = '/_nicegui_ws/socket.io/?EIO=4&transport=websocket'
_UPGRADE = {
    'Connection': 'Upgrade',
    'Upgrade': 'websocket',
    'Sec-WebSocket-Version': '13',
    'Sec-WebSocket-Key': 'AAAAAAAAAAAAAAAAAAAAAA==',
}
_FOREIGN = 'evil.example'
_REFUSED = {400, 403, 421}
_MESSAGES = 20


class PageAttack:
    """An attack on the page whose address stands in a node's log."""

    def __init__(self, log: Path) -> None:
        self._log = log
        self.not_refused: list[str] = []
        """The requests that the page answered otherwise than by a refusal, or not at all."""

    def begin(self, relay: Relay) -> None:
        """Send joint states of wheels to all nodes, and requests of another site to the page."""
        wheels = JointState(name=['left_wheel', 'right_wheel'], position=[1.0, 2.0])
        for _ in range(_MESSAGES):
            relay.publish_past_disturbances(JOINT_STATES, wheels)
        for what, path, headers in self._requests():
            if self._status(path, headers) not in _REFUSED:
                self.not_refused.append(what)

    def is_withstood(self) -> bool:
        """Return whether all was refused, and the page still answers to its own site."""
        own = self._status('/', {'Host': self._address()})
        return not self.not_refused and own == http.client.OK

    def _requests(self) -> Iterator[tuple[str, str, dict[str, str]]]:
        own = self._address()
        foreign = f'{_FOREIGN}:{own.rpartition(":")[2]}'
        yield 'a name that is not ours', '/', {'Host': foreign}
        headers = {**_UPGRADE, 'Host': foreign, 'Origin': f'http://{foreign}'}
        yield 'the socket of a rebound name', _SOCKET, headers
        headers = {**_UPGRADE, 'Host': own, 'Origin': f'http://{_FOREIGN}'}
        yield 'the socket of another site', _SOCKET, headers

    def _status(self, path: str, headers: dict[str, str]) -> int:
        """Return the status of the page's answer; 0 without an answer."""
        connection = http.client.HTTPConnection(self._address(), timeout=_PATIENCE_S)
        try:
            connection.putrequest('GET', path, skip_host=True)
            for name, value in headers.items():
                connection.putheader(name, value)
            connection.endheaders()
            return connection.getresponse().status
        except OSError:
            return 0
        finally:
            connection.close()

    def _address(self) -> str:
        """Return host and port of the page that was started last."""
        lines = self._log.read_text().splitlines() if self._log.exists() else []
        found = [line.removeprefix(LIVE_PAGE) for line in lines if line.startswith(LIVE_PAGE)]
        # Without a page any address will do: it does not answer.
        return urlsplit(found[-1].strip()).netloc if found else '127.0.0.1:9'
