"""The web server of the live page, in its own thread; it ends with the process."""

import asyncio
import ipaddress
import logging
import secrets
import socket
import threading
from collections.abc import Callable

import uvicorn
from fastapi import FastAPI, Request, Response
from fastapi.responses import FileResponse
from nicegui import core, ui

from ja_common.core.config import ConfigError
from ja_dashboard.access_guard import TOKEN, AccessGuard, allow_inline_scripts_of_page
from ja_dashboard.core.access import AccessRules, listed_hosts, own_hosts
from ja_dashboard.core.meeting_view import report_file
from ja_dashboard.image_feed import Picture
from ja_dashboard.meeting_page import PLAIN_PICTURE_URL, REPORT_URL
from ja_dashboard.page import PICTURE_URL, Page, PageModel

_GRACE_S = 1
_PORTS = 50
_NOT_KEPT = {'Cache-Control': 'no-store'}


class Server(threading.Thread):
    """Web server of the live page, as a context manager; open `address` in a browser.

    Where other machines can reach it, `address` holds the token without which it shows nothing.
    """

    def __init__(self, model: PageModel, host: str, port: int, allowed_hosts: str = '') -> None:
        """Take the port, or the next one that is free. Raises ConfigError when none is.

        `allowed_hosts` are further names of this machine, separated by commas.
        """
        super().__init__(name='web server', daemon=True)
        self._socket = _listen(host or '0.0.0.0', port)
        bound, port = self._socket.getsockname()[:2]
        ip = ipaddress.ip_address(bound.partition('%')[0])
        token = None if ip.is_loopback else secrets.token_urlsafe()
        hosts = own_hosts(host, socket.gethostname(), serves_others=token is not None)
        rules = AccessRules([*hosts, *listed_hosts(allowed_hosts)], port, token)
        self.address = f'http://{_shown(host, ip)}:{port}'
        if token is not None:
            self.address += f'/?{TOKEN}={token}'
        logging.getLogger('uvicorn.error').addFilter(_is_no_refused_socket)
        self._server = uvicorn.Server(
            uvicorn.Config(
                AccessGuard(web_app(model), rules, port),
                # The stricter parser: it refuses repeated Host headers, and keeps 'http://x/'
                # apart from '/'.
                http='h11',
                # No proxy is expected: a header may not change the scheme or the client.
                proxy_headers=False,
                log_level='warning',
                timeout_graceful_shutdown=_GRACE_S,
            )
        )

    def __enter__(self) -> 'Server':
        self.start()
        return self

    def run(self) -> None:
        asyncio.run(self._server.serve(sockets=[self._socket]))

    def __exit__(self, *_: object) -> None:
        self._server.should_exit = True
        self.join(2 * _GRACE_S)


def web_app(model: PageModel) -> FastAPI:
    """Return an app that serves the page and its picture; `AccessGuard` belongs before it."""
    app = picture_app(model)
    allow_inline_scripts_of_page()
    # A WebSocket always tells where it comes from; polling by GET does not.
    core.app.config.socket_io_js_transports = ['websocket']
    core.sio.eio.transports = ['websocket']
    ui.run_with(app, root=Page(model).build, title='Joint attention', dark=True)
    return app


def picture_app(model: PageModel) -> FastAPI:
    """Return an app that serves pictures as JPEG, drawn on request, and the report of a meeting.

    Each request of a picture also notes a viewer.
    """
    app = FastAPI(openapi_url=None)

    def jpeg(shown: Picture | None, encode: Callable[[Picture], bytes]) -> Response:
        model.note_viewer()
        if shown is None:
            return Response(status_code=404)
        try:
            content = encode(shown)
        except Exception as error:
            model.report_failure('picture', error)
            return Response(status_code=404)
        return Response(content, media_type='image/jpeg', headers=_NOT_KEPT)

    @app.get(PICTURE_URL)
    def picture() -> Response:
        return jpeg(model.frame.picture, Picture.jpeg)

    @app.get(PLAIN_PICTURE_URL)
    def plain_picture(request: Request) -> Response:
        """Serve the picture of a stamp [ns], the query; the newest one if it is gone."""
        frame = model.frame
        asked = (each for each in frame.recent if str(each.stamp_ns) == request.url.query)
        return jpeg(next(asked, frame.picture), Picture.plain_jpeg)

    @app.get(REPORT_URL)
    def report() -> Response:
        meeting = model.frame.meeting
        file = None if meeting is None else report_file(meeting.report)
        if file is None:
            return Response(status_code=404)
        return FileResponse(file, media_type='text/html', headers=_NOT_KEPT)

    return app


def _listen(host: str, first_port: int) -> socket.socket:
    last_port = min(first_port + _PORTS - 1, 65535)
    for port in range(first_port, last_port + 1):
        try:
            family = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0][0]
            return socket.create_server((host, port), family=family)
        except OSError as error:
            reason = error.strerror
    raise ConfigError(
        f'the page cannot be served on {host}, ports {first_port} to {last_port}: {reason}'
    )


def _is_no_refused_socket(record: logging.LogRecord) -> bool:
    """Leave out uvicorn's complaint about a refused socket: strangers could fill the log."""
    return 'without completing handshake' not in record.getMessage()


def _shown(host: str, ip: ipaddress.IPv4Address | ipaddress.IPv6Address) -> str:
    """Return the host for an address that a browser on this machine can open."""
    if ip.is_unspecified:
        return '127.0.0.1' if ip.version == 4 else '[::1]'
    return f'[{host}]' if ':' in host else host
