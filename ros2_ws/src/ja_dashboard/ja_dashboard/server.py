"""The web server of the live page, in its own thread; it ends with the process."""

import asyncio
import socket
import threading

import uvicorn
from fastapi import FastAPI, Response
from nicegui import ui

from ja_common.core.config import ConfigError
from ja_dashboard.page import PICTURE_URL, Page, PageModel

_GRACE_S = 1
_PORTS = 50


class Server(threading.Thread):
    """Web server of the live page, as a context manager; open `address` in a browser."""

    def __init__(self, model: PageModel, host: str, port: int) -> None:
        """Take the port, or the next one that is free. Raises ConfigError when none is."""
        super().__init__(name='web server', daemon=True)
        self._socket = _listen(host, port)
        shown = '127.0.0.1' if host == '0.0.0.0' else host
        self.address = f'http://{shown}:{self._socket.getsockname()[1]}'
        self._server = uvicorn.Server(
            uvicorn.Config(web_app(model), log_level='warning', timeout_graceful_shutdown=_GRACE_S)
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
    """Return an app that serves the page and its picture."""
    app = picture_app(model)
    ui.run_with(app, root=Page(model).build, title='Joint attention', dark=True)
    return app


def picture_app(model: PageModel) -> FastAPI:
    """Return an app that serves the newest picture as JPEG, drawn on request.

    Each request also notes a viewer.
    """
    app = FastAPI()

    @app.get(PICTURE_URL)
    def picture() -> Response:
        model.note_viewer()
        shown = model.frame.picture
        if shown is None:
            return Response(status_code=404)
        headers = {'Cache-Control': 'no-store'}
        return Response(shown.jpeg(), media_type='image/jpeg', headers=headers)

    return app


def _listen(host: str, first_port: int) -> socket.socket:
    last_port = min(first_port + _PORTS - 1, 65535)
    for port in range(first_port, last_port + 1):
        try:
            return socket.create_server((host, port))
        except OSError as error:
            reason = error.strerror
    raise ConfigError(
        f'the page cannot be served on {host}, ports {first_port} to {last_port}: {reason}'
    )
