"""The web server of the live page, by raw requests over a socket as any program may send them."""

import base64
import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from urllib.parse import urlsplit

import pytest
from nicegui import __version__

import fake_page
from ja_dashboard.meeting_page import MEETING_URL, PLAIN_PICTURE_URL, REPORT_URL
from ja_dashboard.page import PICTURE_URL
from ros_testing import PATIENCE_S

SOCKET_URL = '/_nicegui_ws/socket.io/?EIO=4&transport=websocket'
POLLING_URL = '/_nicegui_ws/socket.io/?EIO=4&transport=polling'
SCRIPT_URL = f'/_nicegui/{__version__}/static/nicegui.js'
ROUTES = ['/', '/any/page', PICTURE_URL, SCRIPT_URL, POLLING_URL, '/favicon.ico', '/docs',
          '/openapi.json', MEETING_URL, PLAIN_PICTURE_URL, REPORT_URL]  # fmt: skip
UPGRADE = (
    'Connection: Upgrade', 'Upgrade: websocket', 'Sec-WebSocket-Version: 13',
    f'Sec-WebSocket-Key: {base64.b64encode(bytes(16)).decode()}',
)  # fmt: skip


@contextmanager
def served(*arguments: str) -> Iterator[str]:
    """Serve the page in a process of its own; NiceGUI serves one page a process."""
    # As a user starts it: under pytest NiceGUI leaves a part out.
    environ = {k: v for k, v in os.environ.items() if k != 'PYTEST_CURRENT_TEST'}
    command = [sys.executable, fake_page.__file__, *arguments]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environ) as process:
        try:
            yield process.stdout.readline().strip()
        finally:
            process.kill()


@pytest.fixture(scope='module')
def local() -> Iterator[str]:
    with served('127.0.0.1', 'lab.example:80') as address:
        yield address


@pytest.fixture(scope='module')
def open_to_others() -> Iterator[str]:
    with served('0.0.0.0') as address:
        yield address


def send(address: str, *lines: str) -> str:
    """Send the lines of a request; return the answer, of a socket its head."""
    at = urlsplit(address)
    with socket.create_connection((at.hostname, at.port), timeout=PATIENCE_S) as connection:
        connection.sendall('\r\n'.join([*lines, '', '']).encode('latin-1'))
        answer = b''
        while b'\r\n\r\n' not in answer or b' 101 ' not in answer:
            part = connection.recv(65536)
            if not part:
                break
            answer += part
    return answer.decode('latin-1')


def status(answer: str) -> int:
    return int(answer.split()[1]) if answer else 0


def get(address: str, path: str = '/', *headers: str, host: str = '') -> str:
    host = host or urlsplit(address).netloc
    return send(address, f'GET {path} HTTP/1.1', f'Host: {host}', 'Connection: close', *headers)


def connect(address: str, *headers: str, host: str = '') -> str:
    """Ask for a socket."""
    host = host or urlsplit(address).netloc
    return send(address, f'GET {SOCKET_URL} HTTP/1.1', f'Host: {host}', *UPGRADE, *headers)


def port_of(address: str) -> int:
    return urlsplit(address).port


def origin_of(address: str) -> str:
    return f'Origin: http://{urlsplit(address).netloc}'


def test_the_page_its_picture_and_its_socket_are_served(local):
    page = get(local)
    assert status(page) == 200
    assert 'Joint attention' in page
    assert 'image/jpeg' in get(local, PICTURE_URL)
    assert status(get(local, MEETING_URL)) == 200
    assert 'image/jpeg' in get(local, PLAIN_PICTURE_URL)
    assert status(get(local, REPORT_URL)) == 404, 'no meeting has ended'
    assert status(connect(local, origin_of(local))) == 101


@pytest.mark.parametrize('route', ROUTES)
def test_no_route_is_served_under_a_foreign_host(local, route):
    for host in ('evil.example', f'evil.example:{port_of(local)}', 'localhost:1'):
        answer = get(local, route, host=host)
        assert status(answer) == 421
        assert 'allowed_hosts' in answer


def test_capitals_and_further_names_are_served(local):
    port = port_of(local)
    for host in (f'LOCALHOST:{port}', f'[::1]:{port}', 'lab.example:80'):
        assert status(get(local, host=host)) == 200


def test_a_socket_is_for_the_page_alone(local):
    at = urlsplit(local).netloc
    for origin in ('http://evil.example', f'https://{at}', f'http://localhost:{port_of(local)}',
                   'null'):  # fmt: skip
        assert status(connect(local, f'Origin: {origin}')) == 403
    assert status(connect(local)) == 403
    assert status(connect(local, origin_of(local), origin_of(local))) in (400, 403)
    # DNS rebinding: Origin and Host agree, and both are foreign.
    evil = f'evil.example:{port_of(local)}'
    assert status(connect(local, f'Origin: http://{evil}', host=evil)) == 421


@pytest.mark.parametrize('route', ROUTES)
def test_no_route_answers_a_foreign_page_or_another_method(local, route):
    assert status(get(local, route, 'Origin: http://evil.example')) == 403
    assert status(get(local, route, 'Sec-Fetch-Site: cross-site')) == 403
    at = urlsplit(local).netloc
    for method in ('POST', 'PUT', 'DELETE', 'OPTIONS', 'PATCH'):
        head = (f'{method} {route} HTTP/1.1', f'Host: {at}', 'Connection: close')
        assert status(send(local, *head, 'Content-Length: 0')) == 405


def test_polling_cannot_replace_the_socket(local):
    """A GET of the page itself has no Origin, as many of another site have none."""
    assert status(get(local, POLLING_URL)) == 400


def test_odd_requests_are_refused(local):
    host = f'Host: {urlsplit(local).netloc}'
    for lines in (
        ('GET / HTTP/1.0',),
        ('GET / HTTP/1.1', 'Connection: close'),
        ('GET / HTTP/1.1', host, 'Host: evil.example'),
        ('GET / HTTP/1.1', 'Host: evil.example', host),
        ('GET / HTTP/1.0', host, host),
        ('GET http://evil.example/ HTTP/1.1', host, 'Connection: close'),
        (f'GET http://evil.example{SOCKET_URL} HTTP/1.1', host, *UPGRADE, origin_of(local)),
        (f'GET {SOCKET_URL} HTTP/1.1', 'Host: evil.example', host, *UPGRADE, origin_of(local)),
        ('CONNECT evil.example:80 HTTP/1.1', host, 'Connection: close'),
        ('OPTIONS * HTTP/1.1', host, 'Connection: close'),
    ):
        assert status(send(local, *lines)) in (400, 421)
    assert status(get(local)) == 200


@pytest.mark.parametrize('route', ['/', PICTURE_URL, SCRIPT_URL])
def test_every_answer_keeps_other_sites_out(local, route):
    for answer in (get(local, route), get(local, route, host='evil.example')):
        head = answer.split('\r\n\r\n')[0].lower()
        for header in (
            'x-content-type-options: nosniff', 'x-frame-options: deny',
            'referrer-policy: no-referrer', 'cross-origin-resource-policy: same-origin',
            "frame-ancestors 'none'", "default-src 'none'",
        ):  # fmt: skip
            assert header in head
        assert 'access-control-allow' not in head
    assert "script-src 'self' 'nonce-" in head
    assert "'unsafe-inline'" not in head.split('script-src')[1].split(';')[0]


def test_inline_scripts_run_by_a_nonce_of_their_answer_alone(local):
    nonces = set()
    for _ in range(2):
        page = get(local)
        nonce = page.split("'nonce-")[1].split("'")[0]
        assert page.count('<script') == page.count(f'<script nonce="{nonce}"') > 0
        nonces.add(nonce)
    assert len(nonces) == 2


def test_a_page_for_others_needs_its_token(open_to_others):
    for route in ROUTES:
        assert status(get(open_to_others, route)) == 401
    wrong = f'Cookie: ja_view_{port_of(open_to_others)}=x'
    for answer in (
        get(open_to_others, '/', wrong),
        get(open_to_others, '/?token=x'),
        get(open_to_others, '/?token='),
        connect(open_to_others, origin_of(open_to_others)),
        connect(open_to_others, origin_of(open_to_others), wrong),
    ):
        assert status(answer) == 401
        assert 'open the address' in answer


def test_the_token_becomes_a_cookie_and_leaves_the_address(open_to_others):
    at = urlsplit(open_to_others)
    answer = get(open_to_others, f'{at.path}?{at.query}')
    assert status(answer) == 303
    lines = answer.split('\r\n')
    assert 'location: /' in lines
    [cookie] = [line for line in lines if line.startswith('set-cookie: ')]
    attributes = cookie.lower().split('; ')[1:]
    assert {'httponly', 'samesite=strict', 'path=/'} <= set(attributes)
    shown = 'Cookie: ' + cookie.removeprefix('set-cookie: ').split(';')[0]
    for route in ('/', PICTURE_URL):
        assert status(get(open_to_others, route, shown)) == 200
    assert status(connect(open_to_others, origin_of(open_to_others), shown)) == 101
    # The cookie does not open the way for other sites.
    assert status(connect(open_to_others, 'Origin: http://evil.example', shown)) == 403
    assert status(get(open_to_others, '/', shown, host='evil.example')) == 421


def test_a_token_leads_nowhere_else(open_to_others):
    query = urlsplit(open_to_others).query
    for path in ('//evil.example', '/\\evil.example', '/any/page'):
        assert 'location: /\r\n' in get(open_to_others, f'{path}?{query}')


def test_every_start_has_a_token_of_its_own(open_to_others):
    with served('0.0.0.0') as other:
        assert len(urlsplit(other).query) >= len('token=') + 43
        assert urlsplit(other).query != urlsplit(open_to_others).query


def test_ipv6_is_served():
    if not has_ipv6():
        pytest.skip('this machine has no IPv6')
    with served('::1') as address:
        assert address.startswith('http://[::1]:')
        assert status(get(address)) == 200
        assert status(connect(address, origin_of(address))) == 101
    with served('::') as address:
        assert 'token=' in address
        assert status(get(address)) == 401


def has_ipv6() -> bool:
    try:
        socket.create_server(('::1', 0), family=socket.AF_INET6).close()
    except OSError:
        return False
    return True
