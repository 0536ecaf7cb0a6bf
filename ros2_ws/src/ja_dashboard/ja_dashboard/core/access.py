"""Who may open the live page: the rules for one request, without a web library.

A web page of any other site runs in the browsers of those who can reach this page, so each request
must have been addressed to us and made by our own page. Names that an attacker points at this
machine (DNS rebinding) differ in `Host`, pages of other sites in `Origin` and `Sec-Fetch-Site`.
"""

import hmac
import ipaddress
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from ja_common.core.config import ConfigError

_HTTP_PORT = 80
_LOOPBACK_NAMES = ('localhost', '127.0.0.1', '[::1]')
_NAME = re.compile(r'(?P<name>[a-z0-9_.-]+|\[[0-9a-f:.]+\])(:(?P<port>[0-9]{1,5}))?', re.ASCII)
_METHODS = ('GET', 'HEAD')


@dataclass(frozen=True)
class Refusal:
    """Why a request is refused: an HTTP status, and one sentence for the one who asked."""

    status: int
    sentence: str


@dataclass(frozen=True)
class RequestHead:
    """What the rules need of a request; `headers` are (name in lower case, value), repeatable.

    `server` is the address (ip, port) at which the connection arrived.
    """

    headers: Sequence[tuple[str, str]]
    path: str
    method: str = 'GET'
    is_socket: bool = False
    server: tuple[str, int] | None = None

    def values(self, name: str) -> list[str]:
        """Return all values of a header; its name in lower case."""
        return [value for known, value in self.headers if known == name]


class AccessRules:
    """The hosts that the page answers to, and its token where other machines can reach it.

    Starlette's TrustedHostMiddleware does not suffice: it ignores the port and repeated headers.
    """

    def __init__(self, hosts: Iterable[str], port: int, token: str | None) -> None:
        """`hosts` are names, [IPv6] or IPv4 addresses, `:port` where it is not the page's own.

        Raises ConfigError for anything else. Without `token` no request needs one.
        """
        self._token = token
        self._hosts = {spelling for host in hosts for spelling in _spellings(host, port)}

    def refusal(self, request: RequestHead) -> Refusal | None:
        """Return why the request is refused, with or without the token; None when it is not."""
        return (
            self._refusal_of_host(request)
            or self._refusal_of_target(request)
            or self._refusal_of_origin(request)
        )

    @property
    def needs_token(self) -> bool:
        """Return whether a request must show the token."""
        return self._token is not None

    def is_token(self, text: str | None) -> bool:
        """Return whether a text is the token; it takes the same time for each wrong one."""
        if self._token is None or text is None:
            return False
        return hmac.compare_digest(text.encode(), self._token.encode())

    def _refusal_of_host(self, request: RequestHead) -> Refusal | None:
        hosts = request.values('host')
        if len(hosts) != 1:
            return Refusal(400, 'A request needs exactly one Host header.')
        host = hosts[0].lower()
        if host in self._hosts or host in _spellings_of_address(request.server):
            return None
        return Refusal(
            421,
            'This page is not served under that host name or port: open the printed address, '
            'or add the name to the parameter allowed_hosts of view.',
        )

    @staticmethod
    def _refusal_of_target(request: RequestHead) -> Refusal | None:
        if not request.path.startswith('/'):
            return Refusal(400, 'This page is no proxy: ask for a path that begins with /.')
        if not request.is_socket and request.method not in _METHODS:
            return Refusal(405, 'This page answers only GET and HEAD.')
        return None

    @staticmethod
    def _refusal_of_origin(request: RequestHead) -> Refusal | None:
        own = f'http://{request.values("host")[0]}'.lower()
        origins = [origin.lower() for origin in request.values('origin')]
        if request.is_socket and origins != [own]:
            return Refusal(403, f'A socket needs the Origin of this page, {own}.')
        if any(origin != own for origin in origins):
            return Refusal(403, 'A page of another site may not use this one.')
        # Browsers add these headers where the address is local; they cannot be forged by a page.
        sites = request.values('sec-fetch-site')
        opened = request.values('sec-fetch-dest') == ['document']
        if any(site not in ('same-origin', 'none') for site in sites) and not opened:
            return Refusal(403, 'A page of another site may not use this one.')
        return None


def own_hosts(bound_host: str, machine_name: str, serves_others: bool) -> list[str]:
    """Return the names of the page on this machine.

    Without `serves_others` the machine's own names are left out: in a local network another
    machine may claim them (mDNS), and no browser needs them to reach a loopback address.
    """
    hosts = [*_LOOPBACK_NAMES]
    if _is_name(bound_host):
        hosts.append(f'[{bound_host}]' if ':' in bound_host else bound_host)
    if serves_others and _is_name(machine_name):
        short = machine_name.split('.')[0]
        hosts += [machine_name, short, f'{short}.local']
    return hosts


def listed_hosts(text: str) -> list[str]:
    """Return the hosts in a text, separated by commas or spaces."""
    return text.replace(',', ' ').split()


def _is_name(host: str) -> bool:
    bare = host.lower()
    return bool(_NAME.fullmatch(f'[{bare}]' if ':' in bare else bare))


def _spellings(host: str, own_port: int) -> list[str]:
    """Return how a browser writes a host in `Host`: without the port where it is HTTP's own."""
    match = _NAME.fullmatch(host.lower())
    port = int(match['port'] or own_port) if match else 0
    if match is None or not 0 < port < 65536:
        raise ConfigError(
            f'allowed_hosts: {host!r} is no NAME or NAME:PORT, as in robot.example.org:8080'
        )
    with_port = f'{match["name"]}:{port}'
    return [with_port, match['name']] if port == _HTTP_PORT else [with_port]


def _spellings_of_address(server: tuple[str, int] | None) -> list[str]:
    """Return the spellings of the numeric address at which a connection has arrived.

    An address in numbers is not looked up, so that it cannot be rebound.
    """
    if server is None:
        return []
    try:
        address = ipaddress.ip_address(server[0].partition('%')[0])
    except ValueError:
        return []
    address = getattr(address, 'ipv4_mapped', None) or address
    return _spellings(f'[{address}]' if address.version == 6 else str(address), server[1])
