"""The server of the page: files of the project, its state, and commands that are queued."""

from __future__ import annotations

import asyncio
import json
import secrets
import socket
import subprocess
from collections.abc import Callable, Mapping
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import uvicorn
from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.requests import ClientDisconnect, Request
from starlette.responses import FileResponse, JSONResponse, Response
from starlette.routing import Route

from identify.app.commands import checked
from identify.app.guard import FRAMED, Guard, inside, upload_name
from identify.app.jobs import PROGRAM, Jobs
from identify.app.state import answer_of, model_of, signature, state_of
from identify.project.folder import Folder
from twin.errors import InputError, Unwritten

STATIC = Path(__file__).parent / "static"
TYPES = {
    ".html": "text/html", ".js": "text/javascript", ".css": "text/css",
    ".json": "application/json", ".png": "image/png", ".svg": "image/svg+xml",
}  # fmt: skip
PAGES = (".html", ".png")  # of the project, that are shown in a frame; all else is downloaded
LOOKS = 0.15  # s between two looks whether anything has changed
LONGEST = 20.0  # s until the page asks again
OWN_NAMES = ("project.toml", "history.sh")


@dataclass
class Server:
    """One project, served. limit: bytes of an upload at most."""

    folder: Folder
    limit: int
    jobs: Jobs = field(init=False)
    asked: dict[tuple[str, ...], tuple[object, Any]] = field(default_factory=dict)
    one: asyncio.Semaphore = field(default_factory=lambda: asyncio.Semaphore(1))

    def __post_init__(self) -> None:
        self.jobs = Jobs(self.folder)

    async def state(self, request: Request) -> Response:
        """The state, as soon as it is another than the one that the page has."""
        since = request.query_params.get("since")
        looks = int(LONGEST / LOOKS) if since else 1
        for _ in range(looks):
            now = await asyncio.to_thread(signature, self.folder, self.jobs)
            if now != since or await request.is_disconnected():
                break
            await asyncio.sleep(LOOKS)
        if now == since:
            return Response(status_code=204)
        told = await asyncio.to_thread(state_of, self.folder, self.jobs)
        return JSONResponse({**told, "signature": now})

    async def run(self, request: Request) -> Response:
        """Queue a command."""
        words = checked(self.folder.root, (await self._given(request)).get("words"))
        job = self.jobs.add(words)
        return JSONResponse({"number": job.number})

    async def stop(self, request: Request) -> Response:
        """Stop a job."""
        number = (await self._given(request)).get("number")
        if not isinstance(number, int):
            raise InputError("give the number of a job")
        await asyncio.to_thread(self.jobs.stop, number)
        return JSONResponse({})

    async def upload(self, request: Request) -> Response:
        """Put a file into the project, whole or not at all."""
        name = upload_name(request.path_params["name"])
        path = self.folder.root / name
        if path.exists() or path.is_symlink() or name in OWN_NAMES:
            raise InputError(f"{name}: is in the project already; rename the one or the other")
        part = path.with_name(f".{name}.{secrets.token_hex(4)}.twin-part")
        try:
            await self._received(request, part, name)
            part.rename(path)
        except OSError as error:
            raise Unwritten(f"{name}: cannot be written: {error.strerror}") from error
        finally:
            part.unlink(missing_ok=True)
        return JSONResponse({"name": name})

    async def _received(self, request: Request, part: Path, name: str) -> None:
        stated, size = int(request.headers.get("content-length") or 0), 0
        with open(part, "xb") as stream:
            if stated <= self.limit:
                async for chunk in request.stream():
                    size += len(chunk)
                    if size > self.limit:
                        break
                    stream.write(chunk)
        if max(size, stated) > self.limit:
            raise InputError(
                f"{name}: is larger than {self.limit / 1e6:.0f} MB; put it into the folder "
                f"{self.folder.root.resolve()} and choose it there"
            )

    async def proposal(self, request: Request) -> Response:
        """What the columns of a file are taken for: `twin import FILE --guess --json`."""
        return JSONResponse(await self._answer_about(request, "import", "--guess"))

    async def signals(self, request: Request) -> Response:
        """What is in a log, with the course of each signal: `twin info LOG --json`."""
        return JSONResponse(await self._answer_about(request, "info"))

    async def effects(self, request: Request) -> Response:
        """The catalogue: `twin effects --json`."""
        return JSONResponse(await self._answer(None, "effects"))

    async def _answer_about(
        self, request: Request, command: str, *options: str
    ) -> Mapping[str, Any]:
        """The answer of a command about a file of the project, asked anew when that has changed."""
        name = request.query_params.get("file", "")
        path = inside(self.folder.root, name)
        stamp = path.stat().st_mtime_ns if path.is_file() else None
        return await self._answer(stamp, command, name, *options)

    async def _answer(self, stamp: object, *words: str) -> Mapping[str, Any]:
        """The answer of a command that changes nothing, asked once."""
        known = self.asked.get(words)
        if known is None or known[0] != stamp:
            async with self.one:
                done = await asyncio.to_thread(
                    subprocess.run, [*PROGRAM, *words, "--json"], cwd=self.folder.root,
                    capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL,
                )  # fmt: skip
            try:
                known = self.asked[words] = stamp, json.loads(done.stdout)
            except ValueError:
                raise InputError(f"{' '.join(words)}: ended without an answer") from None
        answer: Mapping[str, Any] = known[1]
        return answer

    async def model(self, request: Request) -> Response:
        """A model, for its cards."""
        name = request.query_params.get("file", "")
        return JSONResponse(await asyncio.to_thread(model_of, self.folder, name))

    async def answer(self, request: Request) -> Response:
        """A saved answer."""
        name = request.query_params.get("file", "")
        return JSONResponse(await asyncio.to_thread(answer_of, self.folder, name))

    async def file(self, request: Request) -> Response:
        """A file of the project: a page to be shown, anything else to be kept."""
        path = inside(self.folder.root, request.path_params["path"])
        if not path.is_file():
            return Response("no such file\n", 404)
        shown = path.suffix in PAGES and "keep" not in request.query_params
        headers = {"Content-Security-Policy": FRAMED}
        kind = TYPES.get(path.suffix, "application/octet-stream")
        if shown:
            return FileResponse(path, media_type=kind, headers=headers)
        return FileResponse(path, media_type=kind, headers=headers, filename=path.name)

    async def _given(self, request: Request) -> Mapping[str, Any]:
        longest = 100_000  # bytes of a question of the page
        try:
            body = await request.body()
            given = json.loads(body) if len(body) < longest else None
        except ValueError:
            given = None
        if not isinstance(given, dict):
            raise InputError("the request is no JSON object")
        return given


async def static(request: Request) -> Response:
    """A file of the page itself."""
    name = request.path_params.get("name", "index.html")
    if name not in {path.name for path in STATIC.iterdir()}:
        return Response("no such file\n", 404)
    return FileResponse(STATIC / name, media_type=TYPES[Path(name).suffix])


async def refused(request: Request, error: Exception) -> Response:
    """A mistake in one sentence."""
    return JSONResponse({"error": str(error)}, 400)


async def gone(request: Request, error: Exception) -> Response:
    """A file that is not there any more, or a page that was closed."""
    return JSONResponse({"error": "the file is not there any more"}, 404)


def application(server: Server, token: str, port: int) -> Starlette:
    """The routes, behind the guard."""

    @asynccontextmanager
    async def lifespan(app: Starlette) -> Any:
        yield
        await asyncio.to_thread(server.jobs.close)

    get: Mapping[str, Callable[..., Any]] = {
        "/": static, "/static/{name}": static, "/api/state": server.state,
        "/api/proposal": server.proposal, "/api/signals": server.signals,
        "/api/effects": server.effects,
        "/api/model": server.model, "/api/answer": server.answer,
        "/files/{path:path}": server.file,
    }  # fmt: skip
    post = {"/api/run": server.run, "/api/stop": server.stop}
    routes = [
        *(Route(path, job, methods=["GET"]) for path, job in get.items()),
        *(Route(path, job, methods=["POST"]) for path, job in post.items()),
        Route("/api/upload/{name}", server.upload, methods=["PUT"]),
    ]
    return Starlette(
        routes=routes, lifespan=lifespan,
        middleware=[Middleware(Guard, token=token, port=port)],
        exception_handlers={
            InputError: refused, FileNotFoundError: gone, UnicodeDecodeError: gone,
            ClientDisconnect: gone,
        },
    )  # fmt: skip


def listening(port: int) -> socket.socket:
    """A socket of this computer alone; raises InputError where the port is taken."""
    found = socket.socket()
    found.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        found.bind(("127.0.0.1", port))
    except (OSError, OverflowError) as error:
        found.close()
        said = f"port {port}: {getattr(error, 'strerror', None) or error}"
        raise InputError(f"{said}; give another one, or 0 for any that is free") from None
    return found


def serve(folder: Folder, port: int, limit: int, ready: Callable[[str], None]) -> None:
    """Serve a project until Ctrl-C. limit: bytes of an upload; ready: told the address."""
    bound, token = listening(port), secrets.token_urlsafe(24)
    number = bound.getsockname()[1]
    app = application(Server(folder, limit), token, number)
    settings = uvicorn.Config(app, log_config=None, access_log=False, server_header=False,
                              ws="none", timeout_graceful_shutdown=1, lifespan="on")  # fmt: skip
    server = uvicorn.Server(settings)

    async def run() -> None:
        serving = asyncio.create_task(server.serve(sockets=[bound]))
        while not server.started and not serving.done():
            await asyncio.sleep(0.02)
        if server.started:
            ready(f"http://127.0.0.1:{number}/?token={token}")
        await serving

    with suppress(KeyboardInterrupt):
        asyncio.run(run())
