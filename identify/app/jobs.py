"""Commands that a page asked for: run one after the other, as processes that outlive the page.

What a job is and says lies in the project's folder, under `.twin/jobs`.
"""

from __future__ import annotations

import json
import os
import shlex
import shutil
import signal
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from threading import Condition, Thread
from time import time
from typing import Any, Literal

from identify.project.folder import OWN, Folder
from twin.files import write_atomically

PROGRAM = (sys.executable, "-c", "from identify.start import main; main()")
TELLS = {"TWIN_PROGRESS": "0.4"}  # s between two lines on how far a command is
PROGRESS = " so far)"
KEPT = 200  # jobs that are remembered
State = Literal["waiting", "running", "done", "stopped", "killed"]


@dataclass(frozen=True)
class Job:
    """A command. code: of its exit. begun, ended: s since 1970."""

    number: int
    words: tuple[str, ...]
    state: State = "waiting"
    code: int | None = None
    begun: float | None = None
    ended: float | None = None
    process: int | None = None


class Jobs:
    """The queue of a project: each job runs when those before it have ended."""

    def __init__(self, folder: Folder) -> None:
        self.folder, self.place = folder, folder.root / OWN / "jobs"
        self.place.mkdir(parents=True, exist_ok=True)
        self.changed, self.closed = Condition(), False
        self.jobs = {job.number: job for job in map(self._read, self._files()) if job}
        self.running: subprocess.Popen[bytes] | None = None
        for job in [j for j in self.jobs.values() if j.state in ("waiting", "running")]:
            self._set(replace(job, state="killed", ended=time()))
        self.worker = Thread(target=self._work, name="jobs", daemon=True)
        self.worker.start()

    def add(self, words: Sequence[str]) -> Job:
        """Queue a command."""
        with self.changed:
            job = Job(max(self.jobs, default=0) + 1, tuple(words))
            self._set(job)
        return job

    def stop(self, number: int) -> None:
        """End a job as Ctrl-C does, or take it out of the queue."""
        with self.changed:
            job = self.jobs.get(number)
            if job is None or job.state not in ("waiting", "running"):
                return
            self._set(replace(job, state="stopped", ended=time()))
            if job.state == "running" and self.running is not None:
                with suppress(ProcessLookupError):
                    self.running.send_signal(signal.SIGINT)

    def close(self) -> None:
        """End what runs, with the server."""
        with self.changed:
            self.closed = True
            self.changed.notify_all()
        running = self.running
        if running is not None and running.poll() is None:
            running.terminate()
            with suppress(subprocess.TimeoutExpired):
                running.wait(5.0)

    def shown(self) -> list[dict[str, Any]]:
        """The last jobs with what they say, the newest first."""
        last = sorted(self.jobs.values(), key=lambda job: -job.number)[:12]
        return [self._entry(job) for job in last]

    def wait(self, number: int, seconds: float) -> Job:
        """A job when it has ended, or after so many seconds."""
        with self.changed:
            self.changed.wait_for(lambda: self.jobs[number].ended is not None, seconds)
            return self.jobs[number]

    def said(self, job: Job, ending: str) -> str:
        """What a job wrote to standard output (.out) or standard error (.err)."""
        with suppress(OSError):
            return (self.place / f"{job.number}{ending}").read_text("utf-8", "replace")
        return ""

    def _entry(self, job: Job) -> dict[str, Any]:
        lines = self.said(job, ".err").splitlines()
        said = [line.removeprefix("twin: ") for line in lines]
        progress = [line for line in said if line.endswith(PROGRESS)]
        remarks = [line for line in said if not line.endswith(PROGRESS)]
        text = self.said(job, ".out")[:20000]
        if job.code and not remarks and not text:
            remarks = [self._silent(job)]
        return {
            **asdict(job), "command": shlex.join(["twin", *job.words]),
            "progress": progress[-1] if progress and job.state == "running" else None,
            "remarks": remarks[-20:], "text": text,
        }  # fmt: skip

    def _silent(self, job: Job) -> str:
        """Why a job that went wrong says nothing: what it says is written, too."""
        least = 1_000_000  # bytes, less than what a command writes
        if shutil.disk_usage(self.folder.root).free < least:
            return "no space is left on the disk of this folder; nothing of it is half written"
        return f"it ended without saying why, with exit code {job.code}"

    def _work(self) -> None:
        while True:
            with self.changed:
                self.changed.wait_for(lambda: self.closed or self._next() is not None)
                job = self._next()
                if self.closed or job is None:
                    return
                self._set(replace(job, state="running", begun=time()))
            self._run(self.jobs[job.number])

    def _next(self) -> Job | None:
        waiting = (j for j in self.jobs.values() if j.state == "waiting")
        return min(waiting, key=lambda job: job.number, default=None)

    def _run(self, job: Job) -> None:
        out, err = (self.place / f"{job.number}{end}" for end in (".out", ".err"))
        try:
            with open(out, "wb") as stdout, open(err, "wb") as stderr:
                self.running = subprocess.Popen(
                    [*PROGRAM, *job.words], cwd=self.folder.root, env={**os.environ, **TELLS},
                    stdin=subprocess.DEVNULL, stdout=stdout, stderr=stderr,
                    start_new_session=True,
                )  # fmt: skip
                with self.changed:
                    if self.jobs[job.number].state == "stopped":  # before it had begun
                        self.running.send_signal(signal.SIGINT)
                    else:
                        self._set(replace(self.jobs[job.number], process=self.running.pid))
                code = self.running.wait()
        except OSError as error:  # no space, no process
            code = 2
            with suppress(OSError):
                err.write_text(f"twin: cannot be run: {error.strerror}\n", encoding="utf-8")
        with self.changed:
            now = self.jobs[job.number]
            state: State = "killed" if code < 0 else "done"
            state = "stopped" if now.state == "stopped" else state
            self._set(replace(now, state=state, code=code, ended=time()))

    def _set(self, job: Job) -> None:
        with self.changed:
            self.jobs[job.number] = job
            with suppress(Exception):  # of a full disk the page tells all the same
                text = json.dumps(asdict(job))
                write_atomically(self.place / f"{job.number}.json", text.encode())
            for number in sorted(self.jobs)[:-KEPT]:
                del self.jobs[number]
                for file in self.place.glob(f"{number}.*"):
                    file.unlink(missing_ok=True)
            self.changed.notify_all()

    def _files(self) -> list[Path]:
        return [*self.place.glob("*.json")]

    @staticmethod
    def _read(path: Path) -> Job | None:
        try:
            values = json.loads(path.read_text(encoding="utf-8"))
            values["words"] = tuple(values["words"])
            return Job(**values)
        except (OSError, ValueError, TypeError, KeyError):
            return None
