"""Who may ask the server what: a token, this computer's own names, and no file outside a folder."""

from __future__ import annotations

import hmac
import os
import re
from http.cookies import SimpleCookie
from pathlib import Path
from urllib.parse import parse_qs, urlencode

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import PlainTextResponse, RedirectResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from twin.errors import InputError

OWN_NAMES = ("127.0.0.1", "localhost", "[::1]")
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; "
    "connect-src 'self'; frame-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'"
)
# A page of a result runs its own scripts, but in an origin of its own: it can ask this server
# nothing, whoever wrote it.
FRAMED = (
    "sandbox allow-scripts allow-downloads; default-src 'none'; script-src 'unsafe-inline'; "
    "style-src 'unsafe-inline'; img-src data: blob:; frame-ancestors 'self'"
)
HEADERS = {
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
    "Cross-Origin-Resource-Policy": "same-origin",
}


class Guard:
    """Lets in who knows the token, from a page of this server; everybody else gets 403."""

    def __init__(self, app: ASGIApp, token: str, port: int) -> None:
        self.app, self.token, self.cookie = app, token, f"twin-{port}"
        self.hosts = {f"{name}:{port}" for name in OWN_NAMES}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        if why := self._refused(headers):
            await PlainTextResponse(f"{why}\n", 403, HEADERS)(scope, receive, send)
            return
        given = parse_qs(scope["query_string"].decode("latin-1"))
        if self._is_token(*given.pop("token", [])):
            answer = RedirectResponse(f"{scope['path']}?{urlencode(given, True)}".rstrip("?"), 303)
            answer.set_cookie(self.cookie, self.token, httponly=True, samesite="strict")
            answer.headers.update(HEADERS)
            await answer(scope, receive, send)
            return
        if not self._is_token(*self._cookie_tokens(headers)):
            said = "open the address that `twin app` prints, with its token\n"
            await PlainTextResponse(said, 403, HEADERS)(scope, receive, send)
            return

        async def safely(message: Message) -> None:
            if message["type"] == "http.response.start":
                sent = MutableHeaders(scope=message)
                sent.update(HEADERS)
                sent.setdefault("Content-Security-Policy", POLICY)
            await send(message)

        await self.app(scope, receive, safely)

    def _refused(self, headers: Headers) -> str | None:
        """Why a request is refused, whoever asks: another site's page made it."""
        if headers.get("host") not in self.hosts:
            return "this server answers to its own address alone"
        origin = headers.get("origin")
        if origin is not None and origin.removeprefix("http://") not in self.hosts:
            return "another site's page may ask nothing of this server"
        return None

    def _cookie_tokens(self, headers: Headers) -> list[str]:
        """The token of the cookie."""
        cookies = SimpleCookie()
        cookies.load(headers.get("cookie", ""))
        return [cookies[self.cookie].value] if self.cookie in cookies else []

    def _is_token(self, given: str = "", *more: str) -> bool:
        return not more and hmac.compare_digest(given.encode(), self.token.encode())


def inside(root: Path, name: str) -> Path:
    """A file of a folder by its name seen from there; raises InputError for any other.

    Links are followed, and count as what they lead to.
    """
    base = Path(os.path.realpath(root))
    hidden = any(part.startswith(".") for part in Path(name).parts)
    if not ("\0" in name or Path(name).is_absolute() or hidden):
        path = Path(os.path.realpath(base / name))
        if path.is_relative_to(base):
            return path
    raise InputError(f"{name!r}: is no file of this project")


def upload_name(name: str) -> str:
    """The name of a file that is given to the project; raises InputError for one that is a path."""
    if not re.fullmatch(r"[^/\\\0\n\r.-][^/\\\0\n\r]{0,199}", name):
        raise InputError(f"{name!r}: is no name of a file; give one without / that begins plainly")
    return name
