"""What `train --watch` costs training: seconds of the same run with and without it, in turns.

`no page`: the server runs, nobody looks. `page`: a client follows the stream as a page does.
`browser`: Chromium shows the page, which needs playwright and Chromium on PATH. All sides train the
same run, byte for byte, and its seconds of training are read from its records. A machine's speed
drifts by more than watching costs, so the server's own processor time is printed too. Linux only.

    python benchmarks/watch_cost.py --rounds 5
"""

import argparse
import json
import os
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path
from threading import Thread
from typing import IO, cast
from urllib.error import URLError
from urllib.request import urlopen

from touchdown.core import threads
from touchdown.runs.provenance import cpu_name

SERVER = b"touchdown.web.watch.training_server"
SIDES = ("alone", "no page", "page", "browser")


def seconds_of(
    side: str, preset: str, steps: int, open_page: Callable[[str], object]
) -> tuple[float, float]:
    """Train a run; its seconds of training, and the server's of processor time."""
    server_seconds = 0.0
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "touchdown", "train", preset, "--name=x"]
        command += [f"--runs-dir={folder}", f"--max-env-steps={steps}", "--test-episodes=0"]
        command += ["--no-stop-when-solved", *([] if side == "alone" else ["--watch"])]
        no_display = {name: value for name, value in os.environ.items() if name != "DISPLAY"}
        with subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env=no_display
        ) as training:
            said = cast(IO[str], training.stdout)
            if side in ("page", "browser"):
                open_page(said.readline().removeprefix("watch: ").strip())
            said.read()
            # the server outlives the training while a page is open, and for a while without one
            server_seconds = sum(map(processor_seconds, servers()))
        if training.returncode:
            raise SystemExit(f"training failed: {training.args}")
        lines = (Path(folder) / "x" / "episodes.jsonl").read_text("utf-8").splitlines()
        return float(json.loads(lines[-1])["seconds"]), server_seconds


def servers() -> list[int]:
    """The processes that serve a page beside a training."""
    found = (path for path in Path("/proc").glob("[0-9]*/cmdline"))
    return [int(path.parent.name) for path in found if SERVER in read(path).split(b"\0")]


def processor_seconds(process: int) -> float:
    """Seconds of processor time that a process has taken; 0 if it has ended."""
    fields = read(Path(f"/proc/{process}/stat")).rpartition(b")")[2].split()
    return sum(map(int, fields[11:13])) / os.sysconf("SC_CLK_TCK")


def read(path: Path) -> bytes:
    """The content of a process's file; nothing if the process has ended."""
    try:
        return path.read_bytes()
    except OSError:
        return b""


def follow(address: str) -> None:
    """Read the messages to a page in a thread, until they end."""

    def read() -> None:
        try:
            with urlopen(address.replace("?", "events?")) as stream:  # noqa: S310 - our own server
                while stream.readline():
                    pass
        except (URLError, OSError):
            return

    Thread(target=read, daemon=True).start()


@contextmanager
def browser() -> Generator[Callable[[str], object]]:
    """A function that shows a page in Chromium, in place of the one before."""
    from playwright.sync_api import sync_playwright  # noqa: PLC0415 - only one side needs it

    path = shutil.which("chromium") or shutil.which("google-chrome")
    flags = ["--no-sandbox"] if os.geteuid() == 0 else []
    with sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=path, args=flags)
        tab = running.new_page(viewport={"width": 1280, "height": 800})
        yield tab.goto
        running.close()


def end_servers() -> None:
    """Leave nothing of the last side, which would wait for its page to close."""
    while found := servers():
        for server in found:
            with suppress(ProcessLookupError):
                os.kill(server, signal.SIGTERM)
        time.sleep(0.5)


def main() -> None:
    """Train in turns and print ratios."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--preset", default="pilot")
    parser.add_argument("--steps", type=int, default=100_000)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--sides", nargs="+", choices=SIDES, default=["alone", "no page", "page"])
    args = parser.parse_args()
    found: dict[str, list[float]] = {side: [] for side in args.sides}
    of_server: dict[str, list[float]] = {side: [] for side in args.sides}
    with browser() if "browser" in args.sides else nullcontext(follow) as show:
        for number in range(args.rounds):
            # another side begins each round, because a machine's speed drifts
            shift = number % len(args.sides)
            for side in [*args.sides[shift:], *args.sides[:shift]]:
                opened = show if side == "browser" else follow
                seconds, server_seconds = seconds_of(side, args.preset, args.steps, opened)
                found[side].append(seconds)
                of_server[side].append(server_seconds)
                end_servers()
    print(f"{cpu_name()}, {threads.available()} cores, {args.preset}, {args.steps} env steps")
    base = found[args.sides[0]]
    for side, values in found.items():
        ratios = [value / alone for value, alone in zip(values, base, strict=True)]
        print(
            f"{side:8}  {statistics.median(values):7.2f} s  "
            f"x {statistics.median(ratios):.3f} ({min(ratios):.3f} to {max(ratios):.3f})  "
            f"server {statistics.median(of_server[side]):.2f} s"
        )


if __name__ == "__main__":
    main()
