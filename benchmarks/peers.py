"""Compares DQNs of other libraries with this project's presets on the lander, by wall-clock time.

    python benchmarks/peers.py --presets pilot swift --seeds 0 1 2

Every peer trains with its published parameters for the lander, on stock Gymnasium, as its
users would. All take turns on this machine, one process at a time, each on as many cores as it has
threads: `pilot:2` gives a preset two threads.

A peer is evaluated at intervals with its clock stopped: greedily on 100 validation starts, and if
the result is its best so far, or 200 or more, on 100 test starts on stock Gymnasium. It holds the
policy that was best in validation. A preset's own validations count towards its time, and it holds
the policy that they select.

Finished runs are not repeated. An interrupted run is restarted, because its clock cannot be
resumed.
"""

import argparse
import importlib
import json
import math
import multiprocessing
import os
import platform
import signal
import statistics
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from contenders import preset as own
from contenders.watch import Enough, Judge, Watch
from touchdown.config import presets
from touchdown.core import files
from touchdown.figures import wall_clock
from touchdown.lander.rules import SOLVED_RETURN
from touchdown.runs.folder import RunFolder
from touchdown.runs.provenance import cpu_name

MARKS = (10.0, 30.0, 60.0, 120.0, 300.0)  # seconds
PEERS = {"sb3": "Stable-Baselines3 DQN", "sbx": "SBX DQN", "tianshou": "Tianshou DQN"}
OWN = [("pilot", 1), ("swift", 2)]
PACKAGES = ("gymnasium", "stable-baselines3", "sbx-rl", "tianshou", "torch", "jax", "touchdown")
LEFT_OUT = (
    "CleanRL is not included: its package (1.2.0) needs Python before 3.11 and gym 0.23, its "
    "dqn.py is a script that cannot be imported and evaluated while it trains, and it publishes "
    "no parameters for the lander."
)
_LATE = 0.1  # seconds; an evaluation begins within one step after its mark

Row = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Job:
    """One system, one training seed."""

    system: str
    seed: int
    threads: int
    cap: int | None
    """Limit of environment steps; None for the published number."""
    seconds: float | None
    """Limit of the seconds of a peer's training; None for no limit."""

    def path(self, runs: Path) -> Path:
        """The path of its record."""
        return runs / f"{self.system}-{self.seed}.jsonl"


def setting() -> Row:
    """The machine and the versions of a measurement."""
    return {
        "machine": f"{cpu_name()}, {os.cpu_count()} cores",
        "python": platform.python_version(),
        "versions": {package: version(package) for package in PACKAGES},
    }


def measure(job: Job, runs: Path) -> None:
    """Train once and write the record; runs in a separate process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent process ends this one
    path = job.path(runs)
    unfinished = path.with_suffix(".unfinished")
    with unfinished.open("w", encoding="utf-8") as file:

        def record(row: Row) -> None:
            file.write(json.dumps(row, allow_nan=False) + "\n")
            file.flush()

        record(asdict(job) | setting())
        judge = Judge(record)
        if job.system in PEERS:
            peer = importlib.import_module(f"contenders.{job.system}")
            import torch  # noqa: PLC0415 - only peers use it

            torch.set_num_threads(job.threads)
            watch = Watch(judge, MARKS, math.inf if job.seconds is None else job.seconds)
            with suppress(Enough):
                peer.train(job.seed, job.cap or peer.ENV_STEPS, watch)
        else:
            config = own.config_of(job.system, job.seed, job.cap)
            own.train(path.stem, config, runs, judge)
    unfinished.replace(path)


def is_finished(job: Job, runs: Path) -> bool:
    """Whether a job has already been measured.

    Raises:
        SystemExit: it was measured with other settings.
    """
    path = job.path(runs)
    if not path.is_file():
        return False
    facts, *_ = files.read_jsonl(path)
    if asdict(job).items() <= facts.items():
        return True
    raise SystemExit(f"{path}: is a record of {facts}, must be of {job}; choose another --runs-dir")


def run(job: Job, runs: Path) -> bool:
    """Measure a job in a new process on its own cores; return whether it succeeded."""
    cores = os.sched_getaffinity(0)
    # set before the start, so that threads started by libraries on import inherit it
    os.sched_setaffinity(0, sorted(cores)[-job.threads :])
    process = multiprocessing.get_context("spawn").Process(target=measure, args=(job, runs))
    try:
        process.start()
        process.join()
    finally:
        os.sched_setaffinity(0, cores)
        process.kill()
        process.join()
    return process.exitcode == 0


def records_of(system: str, seeds: Sequence[int], runs: Path) -> list[list[Row]]:
    """The record of each finished run of a system: the settings, then the evaluations."""
    paths = [runs / f"{system}-{seed}.jsonl" for seed in seeds]
    return [files.read_jsonl(path) for path in paths if path.is_file()]


def seconds_to_solved(rows: Sequence[Row]) -> float:
    """Time of the first evaluation whose validation and test are both solved; ∞ if none."""
    solved = (
        row["seconds"]
        for row in rows
        if min(row["validation_return"], row.get("test_return", -math.inf)) >= SOLVED_RETURN
    )
    return next(solved, math.inf)


def held_at(rows: Sequence[Row], seconds: float) -> float | None:
    """Test return of the policy held at a time; None before the first one."""
    held = [r["test_return"] for r in rows if r["held"] and r["seconds"] <= seconds + _LATE]
    return held[-1] if held else None


def in_words(seconds: float) -> str:
    """Seconds as text; "never" for ∞."""
    if math.isinf(seconds):
        return "never"
    return f"{seconds:.1f}" if seconds < 10 else f"{seconds:.0f}"


def spread(values: Sequence[float | None]) -> str:
    """A mean over seeds, with minimum and maximum."""
    known = [value for value in values if value is not None]
    if len(known) < len(values) or not known:
        return "–"
    mean = f"{statistics.fmean(known):.0f}"
    return mean if len(known) == 1 else f"{mean} ({min(known):.0f} to {max(known):.0f})"


def name_of(system: str) -> str:
    """The name of a system in tables."""
    return PEERS.get(system, f"`{system}`")


def markdown(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table whose first column is text."""
    lines = [f"| {' | '.join(columns)} |", "| --- |" + " ---: |" * (len(columns) - 1)]
    return "\n".join([*lines, *(f"| {' | '.join(row)} |" for row in rows)])


def time_table(measured: Mapping[str, list[list[Row]]], threads: Mapping[str, int]) -> str:
    """The table of seconds to a verified policy, and to the end of training."""
    columns = ("system", "threads", "time to a verified 200, s", "each seed", "time to its end, s")
    rows: list[list[str]] = []
    for system, runs in measured.items():
        solved = [seconds_to_solved(looks) for looks in runs]
        ends = [looks[-1]["seconds"] for looks in runs]
        env_steps = statistics.fmean(looks[-1]["observations"] for looks in runs)
        rows.append(
            [
                name_of(system),
                str(threads[system]),
                f"**{in_words(statistics.median_low(solved))}**",
                ", ".join(map(in_words, solved)),
                ", ".join(map(in_words, ends)),
                f"{env_steps:,.0f}",
                f"{env_steps / statistics.fmean(ends):,.0f}",
            ]
        )
    return markdown((*columns, "env steps", "env steps/s"), rows)


def return_table(measured: Mapping[str, list[list[Row]]]) -> str:
    """The table of test returns of the held policies at equal times and at the end."""
    columns = ("system", *(f"{mark:.0f} s" for mark in MARKS), "end", "last weights", "landed")
    rows: list[list[str]] = []
    for system, runs in measured.items():
        ends = [[row for row in looks if row["held"]][-1] for looks in runs]
        rows.append(
            [
                name_of(system),
                *(spread([held_at(looks, mark) for looks in runs]) for mark in MARKS),
                f"**{spread([end['test_return'] for end in ends])}**",
                spread([looks[-1]["test_return"] for looks in runs]) if system in PEERS else "–",
                f"{statistics.fmean(end['landed'] for end in ends):.0%}",
            ]
        )
    return markdown(columns, rows)


def settings_of(records: Sequence[list[Row]]) -> str:
    """The machine and the versions of all records; one line for each different setting."""
    texts = [
        f"{facts['machine']}; Python {facts['python']}, "
        + ", ".join(f"{package} {number}" for package, number in facts["versions"].items())
        for facts, *_ in records
    ]
    return "\n".join(dict.fromkeys(texts))


def report(systems: Mapping[str, int], seeds: Sequence[int], runs: Path) -> str:
    """The machine, the versions, and both tables with notes."""
    records = {system: records_of(system, seeds, runs) for system in systems}
    measured = {s: [looks for _, *looks in found] for s, found in records.items() if found}
    verified = (
        "Verified: on 100 validation starts, then on 100 test starts on stock Gymnasium, both "
        "greedily. Bold: the median over seeds. A preset ends when it has selected its policy, a "
        "peer after its published budget or the given seconds."
    )
    returns = (
        "Mean test return of the held policy over seeds, with minimum and maximum; – if a seed "
        "holds none yet. Peers hold the best policy in evaluations at no time cost; the final "
        "weights show the result without them."
    )
    decided: list[str] = []
    for system in (name for name in measured if name not in PEERS):
        folders = [RunFolder(runs / f"{system}-{seed}") for seed in seeds]
        known = [own.seconds_to_decision(f) for f in folders if f.best.is_file()]
        seconds = ", ".join(map(in_words, known))
        decided.append(
            f"`{system}` stopped training after {seconds} s by its own records; the rest of its "
            "time is checkpoint selection."
        )
    parts = [
        settings_of([record for found in records.values() for record in found]),
        f"Training seeds {', '.join(map(str, seeds))}.",
        time_table(measured, systems),
        verified,
        *decided,
        return_table(measured),
        returns,
        LEFT_OUT,
    ]
    return "\n\n".join(parts)


def draw(systems: Mapping[str, int], seeds: Sequence[int], runs: Path, out: Path) -> None:
    """Draw the test return of the held policy over wall-clock time."""
    out.mkdir(parents=True, exist_ok=True)
    curves: dict[str, list[wall_clock.Held]] = {}
    for system in systems:
        for _, *looks in records_of(system, seeds, runs):
            held = [(row["seconds"], row["test_return"]) for row in looks if row["held"]]
            held.append((looks[-1]["seconds"], held[-1][1]))
            seconds, returns = zip(*held, strict=True)
            curves.setdefault(PEERS.get(system, system), []).append((seconds, returns))
    wall_clock.save_wall_clock(out / "peers.png", curves)


def system_of(text: str) -> tuple[str, int]:
    """A system and its threads from `name` or `name:threads`."""
    name, _, threads = text.partition(":")
    if name not in PEERS and name not in presets.PRESETS:
        raise argparse.ArgumentTypeError(f"{name!r}: must be a peer or a preset")
    count = int(threads or 1)
    if not 1 <= count <= len(os.sched_getaffinity(0)):
        raise argparse.ArgumentTypeError(f"{text!r}: threads must be as many as there are cores")
    return name, count


def main() -> None:
    """Run the missing measurements and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--presets", nargs="*", type=system_of, default=OWN)
    parser.add_argument("--peers", nargs="*", choices=list(PEERS), default=list(PEERS))
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2])
    names = ("--env-steps", "--observations")  # the second is the former name
    parser.add_argument(*names, type=int, help="fewer steps than published, for a quick try")
    parser.add_argument("--seconds", type=float, help="limit of a peer's training in seconds")
    parser.add_argument("--runs-dir", type=Path, default=Path("runs") / "peers")
    parser.add_argument(
        "--table", action="store_true", help="print existing results without training"
    )
    parser.add_argument("--figures", type=Path, help="folder for the picture")
    args = parser.parse_args()
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # ends the child process too
    systems: dict[str, int] = dict.fromkeys(args.peers, 1) | dict(args.presets)
    # seed by seed, so that changes in machine speed affect all
    jobs = [
        Job(system, seed, threads, args.env_steps, args.seconds if system in PEERS else None)
        for seed in args.seeds
        for system, threads in systems.items()
    ]
    failed: list[str] = []
    args.runs_dir.mkdir(parents=True, exist_ok=True)
    missing = [job for job in jobs if not is_finished(job, args.runs_dir)]
    for count, job in enumerate([] if args.table else missing, start=1):
        name = job.path(args.runs_dir).stem
        print(f"{count}/{len(missing)} {name}", flush=True)
        try:
            if not run(job, args.runs_dir):
                failed.append(name)
        except KeyboardInterrupt:
            sys.exit(f"stopped during {name}; run the same command to continue")
    print(report(systems, args.seeds, args.runs_dir))
    if args.figures:
        draw(systems, args.seeds, args.runs_dir, args.figures)
    if failed:
        sys.exit(f"failed: {', '.join(failed)}")


if __name__ == "__main__":
    main()
