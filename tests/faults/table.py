"""A table of faults × verbs: what the command line does when it is killed, or its disk fails.

Usage: python tests/faults/table.py [FILE [VERB ...]]

The page with the table is written into FILE after each cell; without names, all verbs are tried.

Each cell starts a verb in a copy of the same folder, lets the fault happen, and looks at the exit
code, the lines on stderr, the files that were there before, and the processes that are left. Where
work can go on, the verb is run again without the fault, and must end as if nothing had happened.
Mounting a small disk takes root; without it those columns are not tried. A verb runs in a fork of
this process, which has loaded its libraries; Linux only.
"""

import fcntl
import hashlib
import importlib
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

os.environ["OMP_NUM_THREADS"] = "1"

from touchdown.cli import app

PRELOADED = (
    "jax",
    "optuna",
    "scipy.stats",
    "touchdown.agents.learners.factory",
    "touchdown.api.exporting",
    "touchdown.api.flying",
    "touchdown.api.playing",
    "touchdown.api.studies",
    "touchdown.api.training",
    "touchdown.api.tuning",
    "touchdown.api.watching",
    "touchdown.figures.curve",
    "touchdown.figures.flights",
    "touchdown.figures.importance",
    "touchdown.figures.policy_map",
    "touchdown.report.comparison",
    "touchdown.report.paper_page",
    "touchdown.report.study_page",
    "touchdown.studies.search",
)
MARK = "TOUCHDOWN_FAULT"
PATIENCE = 240.0  # seconds for a verb; a machine may be busy
LAKE = [
    "--max-env-steps=12000",
    "--validation-period=5000",
    "--validation-episodes=2",
    "--final-validation-episodes=2",
    "--test-episodes=2",
]
STUDY = """
base = "tabular-q"
seeds = {seeds}
[config.training]
max_env_steps = {steps}
checkpoint_seconds = 0.2
validation_period = 5000
validation_episodes = 2
final_validation_episodes = 2
test_episodes = 2
[[factor]]
field = "learning.gamma"
values = {gammas}
"""
INTRODUCTION = """# Faults and commands

`make faults ARGS=docs/faults.md` writes this page. Each cell starts the command in a copy of the
same folder, lets the fault happen, and compares the exit code, the files that were saved before,
and the processes that are left.

- *went on*: the command was run again without the fault, and ended with the same files as if
  nothing had happened.
- *exit 2*: it ended with one line that says what is wrong; *exit 130*: it saved its work and ended.
- *Full disk*: no space is left in the middle of the work. *Read-only*: the folder cannot be
  written. *Moved*: the folder gets another name in the middle of the work. *Locked*: another
  process works on the same run, study or search. *Cut in half*: a file that the command reads was
  truncated.
- –: the fault does not apply to the command.
"""
RUN, STORE = "runs/whole", "runs/studies"
WEIGHTS = f"{RUN}/checkpoints/best.safetensors"


@dataclass(frozen=True)
class Verb:
    """A command and what belongs to it, all as paths in its folder."""

    words: tuple[str, ...]
    begun: str
    """A glob that matches once the work is under way."""
    made: tuple[str, ...]
    """Globs of the files that must be the same as without the fault, once it went on."""
    cut: str
    """A glob of the file that is cut in half beforehand."""
    lock: str | None = None


VERBS = {
    "train": Verb(
        ("train", "--resume", "part"),
        "runs/part/checkpoints/0*",
        ("runs/part/checkpoints/best.safetensors", "runs/part/validations.jsonl"),
        "runs/part/checkpoints/*/state.json",
        "runs/part/lock",
    ),
    "evaluate": Verb(("evaluate", "whole", "--episodes=3000"), "", (), WEIGHTS),
    "fly": Verb(("fly", "whole", "--out=film.gif", "--force"), ".film.*", ("film.gif",), WEIGHTS),
    "export": Verb(
        ("export", "whole", "--format=safetensors", "--out=model", "--force"),
        ".model.*",
        ("model/*",),
        WEIGHTS,
    ),
    "play": Verb(
        ("play", "begin.toml", "--out=play.html", "--force", "--no-browser"),
        ".play.html*",
        ("play.html",),
        "begin.toml",
    ),
    "watch": Verb(
        ("watch", "whole", "--out=watch.html", "--force", "--no-browser"),
        ".watch.html*",
        (),  # the page names a run by a digest of its folder
        f"{RUN}/config.toml",
    ),
    "compare": Verb(
        ("compare", "whole", "--out=page", "--force"),
        "page/figures/*",
        (),
        f"{RUN}/evaluation.json",
    ),
    "tune pid": Verb(
        ("tune", "pid", "--starts=50", "--tolerance=0.5", "--begin=begin.toml", "--out=pid.toml",
         "--force"),
        "",
        ("pid.toml",),
        "begin.toml",
    ),
    "tune agent": Verb(
        ("tune", "agent", "vector-dqn", "--trials=1", "--seeds=1", "--env-steps=3000",
         "--out=tuned.toml", "--force"),
        f"{STORE}/search.sqlite3",
        ("tuned.toml",),
        f"{STORE}/search.sqlite3",
        f"{STORE}/lock",
    ),
    "study run": Verb(
        ("study", "run", "two.toml", "--workers=1"),
        f"{STORE}/runs/*/checkpoints/0*",
        (f"{STORE}/runs/*/checkpoints/best.safetensors", f"{STORE}/runs/*/validations.jsonl"),
        f"{STORE}/studies.json",
        f"{STORE}/lock",
    ),
    "study report": Verb(
        ("study", "report", "done", "--force"),
        f"{STORE}/reports/done/figures/*",
        (f"{STORE}/reports/done/tables/*",),
        f"{STORE}/runs/*/evaluation.json",
    ),
}  # fmt: skip


@dataclass
class Seen:
    """What was seen in a cell."""

    text: str = "–"
    tracebacks: int = 0
    lost: list[str] = field(default_factory=list)
    left: int = 0
    odd: list[str] = field(default_factory=list)
    """What is not as promised."""


@dataclass
class Cell:
    """A folder in which a verb meets a fault."""

    verb: Verb
    folder: Path
    seen: Seen = field(default_factory=Seen)

    def start(self) -> int:
        """Start the verb, and return its process."""
        child = os.fork()
        if child:
            return child
        run(self.verb.words, self.folder, self.errors)
        raise AssertionError

    @property
    def errors(self) -> Path:
        """What the verb wrote to stderr, outside of its folder."""
        return self.folder.with_suffix(".stderr")

    def wait_until_begun(self, process: int) -> None:
        """Wait until the work is under way: a file of it is there, or it has taken some time."""
        before = set(self.folder.glob(self.verb.begun)) if self.verb.begun else set()
        until = time.monotonic() + PATIENCE
        while is_running(process) and time.monotonic() < until:
            if self.verb.begun:
                if set(self.folder.glob(self.verb.begun)) - before:
                    return
            elif cpu_seconds(process) > 0.5:
                return
            time.sleep(0.002)

    def end(self, process: int, codes: tuple[int, ...]) -> None:
        """Wait for the verb and judge its exit code and its lines."""
        code = os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])
        said = self.errors.read_text()
        self.seen.tracebacks += said.count("Traceback")
        self.seen.text = signal.Signals(-code).name if code < 0 else f"exit {code}"
        if code not in codes:
            self.seen.odd.append(f"exit {code}: {said[-300:]}")
        if code == 2 and [line for line in said.splitlines() if line.startswith("touchdown: ")] != [
            line for line in said.splitlines() if line
        ]:
            self.seen.odd.append(f"not one line: {said[-300:]}")
        until = time.monotonic() + 20
        while (left := started_by(self.folder)) and time.monotonic() < until:
            time.sleep(0.05)
        self.seen.left += len(left)
        for number in left:
            with suppress(ProcessLookupError):
                os.kill(number, signal.SIGKILL)

    def go_on(self, wanted: dict[str, str]) -> None:
        """Run the verb again; the files that it makes must be as without a fault."""
        code = os.waitstatus_to_exitcode(os.waitpid(self.start(), 0)[1])
        said = self.errors.read_text()
        self.seen.tracebacks += said.count("Traceback")
        if code != 0:
            self.seen.odd.append(f"went on with exit {code}: {said[-300:]}")
            return
        self.seen.text += ", went on"
        made = hashes(self.folder, self.verb.made)
        if made != wanted:
            differing = sorted(k for k in {*made, *wanted} if made.get(k) != wanted.get(k))
            self.seen.odd.append(f"other content after going on: {differing[:3]}")
        if temporary := [str(path) for path in self.folder.rglob(".*.tmp*")]:
            self.seen.odd.append(f"left behind: {temporary[:3]}")


def hashes(folder: Path, globs: tuple[str, ...]) -> dict[str, str]:
    """SHA-256 of files by their path in a folder."""
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for each in globs
        for path in folder.glob(each)
        if path.is_file()
    }


def saved(folder: Path) -> dict[str, str]:
    """What is finished: a run, and runs of studies."""
    done = [path.parent.name for path in folder.glob(f"{STORE}/runs/*/last.json")]
    return hashes(folder, (f"{RUN}/**/*", "*.toml", *(f"{STORE}/runs/{n}/**/*" for n in done)))


def run(words: tuple[str, ...], folder: Path, errors: Path) -> None:
    """Run the command line in this process, and end it."""
    code = 1
    try:
        os.chdir(folder)
        os.environ[MARK] = str(folder)
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        os.dup2(os.open(errors, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644), 2)
        app.main(list(words))
        code = 0
    except SystemExit as stop:
        code = int(stop.code or 0)
    except BaseException:  # noqa: BLE001 - what a person would see
        traceback.print_exc()
    finally:
        with suppress(OSError):
            sys.stderr.flush()
        os._exit(code)


def is_running(process: int) -> bool:
    """Whether a process has not ended yet; it is still to be waited for."""
    found = os.waitid(os.P_PID, process, os.WEXITED | os.WNOHANG | os.WNOWAIT)
    return found is None


def cpu_seconds(number: int) -> float:
    """Seconds of processor time that a process has taken."""
    with suppress(OSError, IndexError):
        fields = Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return 0.0


def started_by(folder: Path) -> list[int]:
    """The processes that a verb in a folder has started."""
    mark, found = f"{MARK}={folder}".encode(), []
    for path in Path("/proc").glob("[0-9]*/environ"):
        with suppress(OSError):
            if mark in path.read_bytes().split(b"\0"):
                found.append(int(path.parent.name))
    return found


# --- faults: each gets a cell, and what the verb makes without a fault ---


def by_signal(number: int, codes: tuple[int, ...]) -> Callable[[Cell, dict[str, str]], None]:
    def fault(cell: Cell, wanted: dict[str, str]) -> None:
        process = cell.start()
        cell.wait_until_begun(process)
        os.kill(process, number)
        cell.end(process, codes)
        cell.go_on(wanted)

    return fault


def moved(cell: Cell, wanted: dict[str, str]) -> None:
    """The folder of all runs is moved while the verb is at work."""
    process = cell.start()
    cell.wait_until_begun(process)
    (cell.folder / "runs").rename(cell.folder / "elsewhere")
    cell.end(process, (0, 2))
    again = cell.folder / "runs"
    if again.exists():
        cell.seen.odd.append(f"made again: {[str(p) for p in again.rglob('*')][:3]}")
        shutil.rmtree(again)
    (cell.folder / "elsewhere").rename(again)
    if cell.seen.text != "exit 0":
        cell.go_on(wanted)


def full(cell: Cell, wanted: dict[str, str]) -> None:
    """The disk has no space left."""
    filler = cell.folder / "filler"
    with filler.open("wb", buffering=0) as file, suppress(OSError):
        while True:
            file.write(bytes(4_096))
    process = cell.start()
    cell.end(process, (0, 2))
    filler.unlink()
    if cell.seen.text != "exit 0":
        cell.go_on(wanted)


def read_only(cell: Cell, _wanted: dict[str, str]) -> None:
    """The disk is mounted read-only."""
    _mount("-o", "remount,ro", str(cell.folder))
    process = cell.start()
    cell.end(process, (0, 2))
    _mount("-o", "remount,rw", str(cell.folder))


def locked(cell: Cell, _wanted: dict[str, str]) -> None:
    """Another process is at work on the same run or results."""
    if cell.verb.lock is None:
        return
    before = hashes(cell.folder, ("**/*",))
    with (cell.folder / cell.verb.lock).open("ab") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        cell.end(cell.start(), (2,))
    after = hashes(cell.folder, ("**/*",))
    if after != before:
        cell.seen.odd.append(f"changed: {sorted({*after.items()} ^ {*before.items()})[:3]}")


def cut(cell: Cell, _wanted: dict[str, str]) -> None:
    """The file that the verb reads has lost its second half; if it makes it, on its second run."""
    if not list(cell.folder.glob(cell.verb.cut)):
        cell.end(cell.start(), (0,))
    for path in cell.folder.glob(cell.verb.cut):
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    cell.end(cell.start(), (2,))


FAULTS = {
    "kill -9": by_signal(signal.SIGKILL, (-9, 0)),
    "SIGTERM": by_signal(signal.SIGTERM, (130, 0)),
    "SIGHUP": by_signal(signal.SIGHUP, (130, 0)),
    "full disk": full,
    "read-only": read_only,
    "moved": moved,
    "locked": locked,
    "cut in half": cut,
}
ON_A_DISK = ("full disk", "read-only")


def _mount(*words: str) -> None:
    subprocess.run(["mount", *words], check=True, capture_output=True)


@contextmanager
def disk(folder: Path, *, small: bool) -> Iterator[None]:
    """A folder, on a small disk of its own if that is wanted."""
    folder.mkdir()
    if small:
        _mount("-t", "tmpfs", "-o", "size=64m", "tmpfs", str(folder))
    try:
        yield
    finally:
        if small:
            subprocess.run(["umount", "--lazy", str(folder)], check=False)


def prepare(base: Path) -> None:
    """Fill a folder: a finished run, an unfinished one, a finished study, one not begun."""
    base.mkdir()

    def touchdown(*words: str) -> None:
        cell = Cell(Verb(words, "", (), ""), base)
        cell.end(cell.start(), (0,))
        if cell.seen.odd:
            raise SystemExit(f"{words}: {cell.seen.odd}")

    touchdown("train", "tabular-q", *LAKE, "--name=whole")
    part = Cell(
        Verb(
            ("train", "tabular-q", *LAKE, "--checkpoint-seconds=0.2", "--name=part"),
            "runs/part/checkpoints/0*",
            (),
            "",
        ),
        base,
    )
    process = part.start()
    part.wait_until_begun(process)
    os.kill(process, signal.SIGTERM)
    part.end(process, (130,))
    (base / "done.toml").write_text(STUDY.format(seeds=1, steps=2_000, gammas=[0.9]))
    (base / "two.toml").write_text(STUDY.format(seeds=1, steps=12_000, gammas=[0.95, 0.99]))
    touchdown("study", "run", "done.toml")
    touchdown("tune", "pid", "--starts=2", "--tolerance=0.9", "--out=begin.toml")


def meet(name: str, fault: str, base: Path, wanted: dict[str, str]) -> Seen:
    """Let a verb meet a fault."""
    verb = VERBS[name]
    folder = base.parent / f"{name}-{fault}".replace(" ", "-")
    with disk(folder, small=fault in ON_A_DISK):
        shutil.copytree(base, folder, dirs_exist_ok=True)
        before = saved(folder)
        cell = Cell(verb, folder)
        FAULTS[fault](cell, wanted)
        if fault != "cut in half":
            after = saved(folder)
            cell.seen.lost = [path for path in before if after.get(path) != before[path]]
        return cell.seen


def text_of(table: dict[tuple[str, str], Seen], verb: str) -> list[str]:
    """The cells of a row."""
    return [table.get((verb, fault), Seen("not tried")).text for fault in FAULTS]


def markdown(table: dict[tuple[str, str], Seen], seconds: float) -> str:
    """The page with the table, and the counts."""
    tried = [seen for seen in table.values() if seen.text not in ("–", "not tried")]
    counts = (
        f"{sum(seen.tracebacks for seen in tried)} tracebacks",
        f"{sum(len(seen.lost) for seen in tried)} saved files lost or changed",
        f"{sum(seen.left for seen in tried)} processes left",
        f"{sum(len(seen.odd) for seen in tried)} other surprises",
    )
    lines = [
        INTRODUCTION,
        f"| command | {' | '.join(FAULTS)} |",
        f"| --- |{' --- |' * len(FAULTS)}",
        *(
            f"| `{verb}` | {' | '.join(text_of(table, verb))} |"
            for verb in dict.fromkeys(verb for verb, _ in table)
        ),
        "",
        f"{len(tried)} cases in {seconds:.0f} s: **{', '.join(counts)}**.",
    ]
    return "\n".join(lines) + "\n"


def try_verb(name: str, base: Path, table: dict[tuple[str, str], Seen]) -> Iterator[None]:
    """Let a verb meet each fault, one at a time."""
    verb = VERBS[name]
    folder = base.parent / name.replace(" ", "-")
    shutil.copytree(base, folder)
    cell = Cell(verb, folder)
    cell.end(cell.start(), (0,))
    if cell.seen.odd:
        raise SystemExit(f"{name} without a fault: {cell.seen.odd}")
    wanted = hashes(folder, verb.made)
    for fault in FAULTS:
        if fault in ON_A_DISK and os.geteuid() != 0:
            table[name, fault] = Seen("not tried")
            continue
        seen = table[name, fault] = meet(name, fault, base, wanted)
        for odd in [*seen.odd, *(f"lost: {path}" for path in seen.lost)]:
            sys.stderr.write(f"{name} × {fault}: {odd}\n")
            sys.stderr.flush()
        yield


def main() -> None:
    """Try everything, and print or write the table."""
    began = time.monotonic()
    out = Path(sys.argv[1]).absolute() if len(sys.argv) > 1 else None
    warnings.simplefilter("ignore")  # JAX warns of forks, but computes only after them
    for name in PRELOADED:
        importlib.import_module(name)
    table: dict[tuple[str, str], Seen] = {}
    with tempfile.TemporaryDirectory(prefix="touchdown-faults-") as name:
        base = Path(name) / "base"
        prepare(base)
        for verb in sys.argv[2:] or VERBS:
            for _ in try_verb(verb, base, table):
                if out is not None:
                    out.write_text(markdown(table, time.monotonic() - began), "utf-8")
    sys.stdout.write(markdown(table, time.monotonic() - began))
    raise SystemExit(any(s.odd or s.lost or s.left or s.tracebacks for s in table.values()))


if __name__ == "__main__":
    main()
