"""A page in a real browser, by the browser's own protocol: what a script sees, and what goes wrong.

https://chromedevtools.github.io/devtools-protocol, over two pipes: no package is needed.
"""

from __future__ import annotations

import base64
import fcntl
import json
import os
import select
import shutil
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome")
LONGEST = 120.0  # s without an answer, on a busy machine
# A page's own tools: choose an entry as a user does, and wait for the frame that follows.
TOOLS = """
const frame = () => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)));
const choose = (id, value) => { const e = document.getElementById(id); e.value = value;
  e.dispatchEvent(new Event("change")); return frame(); };
const span = id => { const x = document.getElementById(id).shown.scales.x; return [x.min, x.max]; };
const text = id => document.getElementById(id).textContent;
"""


class Browser:
    """A running browser with one page, which tells errors and requests of the page."""

    def __init__(self, sent: int, told: int) -> None:
        self._sent, self._told = os.fdopen(sent, "wb", 0), os.fdopen(told, "rb", 0)
        self._waiting, self._count, self._session = b"", 0, ""
        self.events: list[dict[str, Any]] = []
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        attached = self.call("Target.attachToTarget", targetId=target, flatten=True)
        self._session = attached["sessionId"]
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **given: Any) -> dict[str, Any]:
        """The answer to one command."""
        self._count += 1
        message = {"id": self._count, "method": method, "params": given}
        session = {"sessionId": self._session} if self._session else {}
        self._sent.write(json.dumps({**message, **session}).encode() + b"\0")
        while True:
            heard = self._hear()
            if heard.get("id") == self._count:
                assert "error" not in heard, heard
                return dict(heard["result"])

    def _hear(self) -> dict[str, Any]:
        while b"\0" not in self._waiting:
            ready, _, _ = select.select([self._told], [], [], LONGEST)
            assert ready, "the browser does not answer"
            more = self._told.read(1 << 16)
            assert more, "the browser has ended"
            self._waiting += more
        line, _, self._waiting = self._waiting.partition(b"\0")
        heard: dict[str, Any] = json.loads(line)
        self.events += [heard] if "method" in heard else []
        return heard

    def open(self, page: Path, width: int = 1280, height: int = 800) -> None:
        """Load a page whole, in a window of that size in pixels."""
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self.call("Emulation.setDeviceMetricsOverride", **size)
        self.events.clear()
        address = page.resolve().as_uri()
        self.call("Page.navigate", url=address)
        while not self._loaded(address):  # what is heard first may be of the page before
            self._hear()
        self.run("await frame()")  # its scripts fill a part of it in the frame after loading

    def _loaded(self, address: str) -> bool:
        there = False
        for event in self.events:
            if event["method"] == "Page.frameNavigated":
                there = event["params"]["frame"]["url"] == address
            elif there and event["method"] == "Page.loadEventFired":
                return True
        return False

    def run(self, script: str) -> Any:
        """What a script, the body of a function, returns in the page."""
        found = self.call(
            "Runtime.evaluate", expression=f"(async () => {{ {TOOLS} {script} }})()",
            awaitPromise=True, returnByValue=True,
        )  # fmt: skip
        assert "exceptionDetails" not in found, found["exceptionDetails"]
        return found["result"].get("value")

    @property
    def errors(self) -> list[str]:
        """What the page wrote to the console as an error, or did not catch."""
        wrong = ("Runtime.exceptionThrown", "Log.entryAdded")
        return [json.dumps(e["params"]) for e in self.events if e["method"] in wrong]

    @property
    def requests(self) -> list[str]:
        """Addresses that were asked for, the page's own first."""
        sent = (e["params"] for e in self.events if e["method"] == "Network.requestWillBeSent")
        return [one["request"]["url"] for one in sent]

    def paint(self) -> float:
        """s from the start of loading to the first paint with content."""
        script = """let p; const end = performance.now() + 5000;
        while (!(p = performance.getEntriesByName("first-contentful-paint")[0]) &&
          performance.now() < end) await frame();
        return p.startTime;"""
        return float(self.run(script)) / 1e3

    def picture(self, path: Path, whole: bool = False) -> None:
        """A screenshot as PNG, of the window or of the whole page."""
        shot = self.call("Page.captureScreenshot", captureBeyondViewport=whole)
        path.write_bytes(base64.b64decode(shot["data"]))


@contextmanager
def browser(folder: Path) -> Iterator[Browser]:
    """A browser with its profile in a folder; the test is skipped where there is none."""
    found = os.environ.get("CHROME") or next(filter(None, map(shutil.which, NAMES)), None)
    if found is None:
        pytest.skip(f"no browser: none of {', '.join(NAMES)} is installed")
    (to_read, sent), (told, to_write) = os.pipe(), os.pipe()
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--no-first-run"]
    options += ["--enable-unsafe-swiftshader"]  # WebGL without a graphics card
    quiet = ["--disable-extensions", "--disable-background-networking", "--remote-debugging-pipe"]
    at = {3: to_read, 4: to_write}  # where the browser's end of the pipes is looked for
    high = {fd: fcntl.fcntl(pipe, fcntl.F_DUPFD, 10) for fd, pipe in at.items()}
    process = subprocess.Popen(
        [found, *options, *quiet, f"--user-data-dir={folder / 'profile'}"],
        preexec_fn=lambda: [os.dup2(pipe, fd) for fd, pipe in high.items()],
        pass_fds=tuple(at), stderr=subprocess.DEVNULL, start_new_session=True,
    )  # fmt: skip
    for pipe in (to_read, to_write, *high.values()):
        os.close(pipe)
    try:
        yield Browser(sent, told)
    finally:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        time.sleep(0.1)  # its children let go of the folder
