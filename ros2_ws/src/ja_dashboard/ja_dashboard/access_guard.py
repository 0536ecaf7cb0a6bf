"""The guard before the web app: who may open the page, and what a browser may do with it."""

import secrets
from collections.abc import Awaitable, Callable, MutableMapping
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qsl, urlencode

from fastapi import Request, Response
from fastapi.responses import PlainTextResponse, RedirectResponse
from fastapi.templating import Jinja2Templates
from jinja2.ext import Extension
from nicegui import client

from ja_dashboard.core.access import AccessRules, Refusal, RequestHead

# ASGI, https://asgi.readthedocs.io/en/latest/specs/main.html
Scope = MutableMapping[str, Any]
Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]

TOKEN = 'token'
"""The token's name in the query of the printed address."""

_HEADERS = {
    'X-Content-Type-Options': 'nosniff',
    'X-Frame-Options': 'DENY',
    'Referrer-Policy': 'no-referrer',
    'Cross-Origin-Opener-Policy': 'same-origin',
    'Cross-Origin-Resource-Policy': 'same-origin',
}
# NiceGUI's client evaluates code that the server sends, and Vue compiles templates: 'unsafe-eval'.
# Quasar and the charts set styles of elements: 'unsafe-inline' for styles alone.
_POLICY = (
    "default-src 'none'; script-src 'self' 'nonce-{nonce}' 'unsafe-eval'; "
    "style-src 'self' 'unsafe-inline'; img-src 'self' data:; font-src 'self' data:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_NO_TOKEN = Refusal(
    401, 'This page needs its token: open the address that its program has printed, in full.'
)


class AccessGuard:
    """An ASGI app that lets through to `app` what `rules` allow; all routes and sockets pass it.

    A browser shows the token once, in the query of the printed address; from then on a cookie has
    it. Every answer carries the headers that keep other sites out.
    """

    def __init__(self, app: App, rules: AccessRules, port: int) -> None:
        self._app = app
        self._rules = rules
        # Browsers share cookies among all ports of a host.
        self._cookie = f'ja_view_{port}'

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope['type'] not in ('http', 'websocket'):
            await self._app(scope, receive, send)
            return
        nonce = secrets.token_urlsafe(16)
        scope.setdefault('state', {})['csp_nonce'] = nonce

        policy = {'Content-Security-Policy': _POLICY.format(nonce=nonce)}
        headers = [
            (name.lower().encode(), value.encode()) for name, value in (_HEADERS | policy).items()
        ]

        async def send_with_headers(message: Message) -> None:
            if message['type'] in ('http.response.start', 'websocket.http.response.start'):
                message['headers'] = [*message.get('headers', ()), *headers]
            await send(message)

        answer = self._answer(scope) or self._app
        await answer(scope, receive, send_with_headers)

    def _answer(self, scope: Scope) -> Response | None:
        """Return the answer to a request that does not reach the app."""
        head = _head(scope)
        if refusal := self._rules.refusal(head):
            return _response(refusal)
        if not self._rules.needs_token:
            return None
        if not head.is_socket and self._rules.is_token(_query(scope).get(TOKEN)):
            return self._without_token_in_address(scope)
        return None if self._rules.is_token(self._token_in_cookie(head)) else _response(_NO_TOKEN)

    def _token_in_cookie(self, head: RequestHead) -> str | None:
        try:
            cookies = SimpleCookie('; '.join(head.values('cookie')))
        except CookieError:
            return None
        return cookies[self._cookie].value if self._cookie in cookies else None

    def _without_token_in_address(self, scope: Scope) -> Response:
        query = _query(scope)
        token = query.pop(TOKEN)
        # Not the path that was asked for: `//evil.example` would lead to another site.
        response = RedirectResponse('/' + (f'?{urlencode(query)}' if query else ''), 303)
        response.set_cookie(self._cookie, token, httponly=True, samesite='strict')
        response.headers['Cache-Control'] = 'no-store'
        return response


def allow_inline_scripts_of_page() -> None:
    """Give the scripts in NiceGUI's page template the nonce of the Content-Security-Policy.

    It stands in the template's source, so that no text of the graph that looks like a script gets
    one.
    """
    client.templates = Jinja2Templates(
        env=client.templates.env.overlay(extensions=[_ScriptNonce]),
        context_processors=[_nonce],
    )


class _ScriptNonce(Extension):
    """Writes the nonce into each script tag of a template."""

    def preprocess(self, source: str, name: str | None, filename: str | None = None) -> str:
        return source.replace('<script', '<script nonce="{{ csp_nonce }}"')


def _nonce(request: Request) -> dict[str, str]:
    return {'csp_nonce': getattr(request.state, 'csp_nonce', '')}


def _head(scope: Scope) -> RequestHead:
    return RequestHead(
        headers=[
            (name.decode('latin-1').lower(), value.decode('latin-1'))
            for name, value in scope['headers']
        ],
        path=scope['path'],
        method=scope.get('method', 'GET'),
        is_socket=scope['type'] == 'websocket',
        server=scope.get('server'),
    )


def _query(scope: Scope) -> dict[str, str]:
    return dict(parse_qsl(scope['query_string'].decode('latin-1'), keep_blank_values=True))


def _response(refusal: Refusal) -> Response:
    return PlainTextResponse(f'{refusal.sentence}\n', refusal.status)
