"""Search over settings that the paper leaves unstated: several candidates, several seeds each.

    python benchmarks/search.py benchmarks/search/paper-best.toml --seeds 0 1 2

A search file names a preset to start from and one table of overridden settings a candidate. Every
run is an ordinary run folder; what is there already is not trained again, and what was stopped goes
on. A candidate is judged on validation starts alone; no test start is flown.
"""

import argparse
import json
import multiprocessing
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from touchdown.config import presets
from touchdown.config.config import Config
from touchdown.config.toml import read_toml, replace_fields
from touchdown.core import device, files, threads
from touchdown.policies import weights as policy_weights
from touchdown.runs import folder as folders
from touchdown.runs.folder import RunFolder
from touchdown.runs.provenance import cpu_name
from touchdown.training.trainer import Trainer


def candidates_of(path: Path) -> dict[str, Config]:
    """Each candidate's config, without a test."""
    values = read_toml(path)
    base = presets.preset(values.pop("preset"))
    base = replace(base, training=replace(base.training, test_episodes=0))
    return {name: replace_fields(base, table, f"{path} [{name}]") for name, table in values.items()}


def train(job: tuple[str, Config, Path]) -> str:
    """Train one candidate with one seed to its end, in a process of its own."""
    name, config, runs = job
    device.use("cpu")
    path = runs / f"{name}-{config.seed}"
    folder = (
        RunFolder(path)
        if (path / "config.toml").is_file()
        else folders.create(runs, config, path.name)
    )
    if folder.config() != config:
        raise SystemExit(f"{path} holds another config; remove it or search elsewhere")
    trainer = Trainer(folder)
    try:
        trainer.run()
    finally:
        trainer.close()
    return path.name


def result_of(folder: RunFolder) -> dict[str, Any] | None:
    """What one finished run says, from its records."""
    if not folder.best.is_file():
        return None
    facts = policy_weights.facts_of(folder.best)
    if facts.final_validation_return is None:
        return None
    episodes = files.read_jsonl(folder.episodes)
    recent = [row["episode_return"] for row in episodes[-100:]]
    return {
        "best": facts.final_validation_return,
        "last": files.read_jsonl(folder.validations)[-1]["mean_return"],
        "training": sum(recent) / len(recent),
        "seconds": episodes[-1]["seconds"],
        "observations": episodes[-1]["observations"],
    }


def table(names: Sequence[str], seeds: Sequence[int], runs: Path) -> str:
    """A Markdown table: the finished seeds of each candidate."""
    lines = [
        "| candidate | best checkpoint, by seed | mean | last weights | last 100 episodes | s |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for name in names:
        found = [result_of(RunFolder(runs / f"{name}-{seed}")) for seed in seeds]
        done = [result for result in found if result]
        if not done:
            continue

        def each(key: str, found: Sequence[dict[str, Any] | None] = found) -> str:
            return ", ".join(f"{result[key]:.0f}" if result else "-" for result in found)

        mean = sum(result["best"] for result in done) / len(done)
        lines.append(
            f"| {name} | {each('best')} | {mean:.0f} | {each('last')} "
            f"| {each('training')} | {each('seconds')} |"
        )
    return "\n".join(lines)


def main() -> None:
    """Train what is missing, two at a time, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("file", type=Path)
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2])
    parser.add_argument("--only", nargs="+", help="candidates; all without it")
    parser.add_argument("--runs-dir", type=Path)
    parser.add_argument("--workers", type=int, default=threads.available())
    parser.add_argument("--table", action="store_true", help="print what is there, train nothing")
    args = parser.parse_args()
    runs = args.runs_dir or Path("runs") / f"search-{args.file.stem}"
    candidates = candidates_of(args.file)
    names = args.only or list(candidates)
    jobs = [
        (name, replace(candidates[name], seed=seed), runs) for seed in args.seeds for name in names
    ]
    if not args.table:
        began = time.monotonic()
        threads.share(args.workers)
        with multiprocessing.get_context("spawn").Pool(args.workers, maxtasksperchild=1) as pool:
            for count, name in enumerate(pool.imap_unordered(train, jobs, chunksize=1), start=1):
                minutes = (time.monotonic() - began) / 60
                best = json.dumps(result_of(RunFolder(runs / name)))
                print(f"{count}/{len(jobs)} {minutes:.1f} min {name} {best}", flush=True)
    print(f"{cpu_name()}, one thread a run, {args.workers} at a time; seeds {args.seeds}")
    print(table(names, args.seeds, runs))


if __name__ == "__main__":
    main()
