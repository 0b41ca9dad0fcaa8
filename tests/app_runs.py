"""`twin app` as a process, and a real browser that walks it; skipped where either is missing."""

from __future__ import annotations

import asyncio
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import pytest

LONGEST = 240_000  # ms until something is seen, on a busy machine


@contextmanager
def served(folder: Path, *options: str) -> Iterator[str]:
    """The address of the page of a project."""
    pytest.importorskip("starlette", reason="the extra app is not installed")
    pytest.importorskip("uvicorn", reason="the extra app is not installed")
    words = ["app", str(folder), "--no-open", *options]
    program = [sys.executable, "-c", "from identify.start import main; main()", *words]
    with subprocess.Popen(program, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as server:
        assert server.stdout is not None
        try:
            address = server.stdout.readline().decode().strip()
            assert address.startswith("http://127.0.0.1:"), address
            yield address
        finally:
            server.send_signal(signal.SIGINT)
            server.wait(20.0)


@contextmanager
def browsed(**options: Any) -> Iterator[Any]:
    """A context of Chromium, in which nothing may be loaded from elsewhere and no script fail."""
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    program = shutil.which("chromium") or shutil.which("google-chrome")
    if program is None:
        pytest.skip("there is no Chromium on this computer")
    with playwright.sync_playwright() as running:
        browser = running.chromium.launch(executable_path=program, args=["--no-sandbox"])
        context = browser.new_context(**{"viewport": {"width": 1280, "height": 900}, **options})
        context.set_default_timeout(LONGEST)
        wrong: list[str] = []
        context.on("weberror", lambda error: wrong.append(str(error.error)))
        context.on("console", lambda m: wrong.append(m.text) if m.type == "error" else None)
        context.on("request", lambda r: wrong.append(r.url) if away(r.url) else None)
        try:
            yield context
        finally:
            browser.close()
        assert wrong == []


def away(url: str) -> bool:
    """Whether something is asked of another computer."""
    return not url.startswith(("http://127.0.0.1:", "data:", "blob:", "about:"))


@dataclass(frozen=True)
class Answer:
    """What a server answers."""

    status: int
    headers: dict[str, str]
    body: bytes


def asked(app: Any, path: str, method: str = "GET", body: bytes = b"", **headers: str) -> Answer:
    """What an application answers to one request, without a network."""
    sent: list[dict[str, Any]] = []
    place, _, query = path.partition("?")
    scope = {
        "type": "http", "http_version": "1.1", "method": method, "scheme": "http",
        "path": unquote(place), "raw_path": place.encode(), "root_path": "",
        "query_string": query.encode(), "client": ("127.0.0.1", 1), "server": ("127.0.0.1", 1),
        "headers": [(k.replace("_", "-").encode(), v.encode()) for k, v in headers.items()],
    }  # fmt: skip

    heard = iter([{"type": "http.request", "body": body, "more_body": False}])

    async def receive() -> dict[str, Any]:
        return next(heard, {"type": "http.disconnect"})

    async def send(message: Any) -> None:
        sent.append(message)

    asyncio.run(app(scope, receive, send))
    told = {k.decode(): v.decode() for k, v in sent[0]["headers"]}
    return Answer(sent[0]["status"], told, b"".join(m.get("body", b"") for m in sent[1:]))
