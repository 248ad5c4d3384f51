"""Every rung of the ladder on the lander: equal observations, several training seeds, one table.

    python benchmarks/ladder.py --seeds 0 1 2 3 4

Every run is an ordinary run folder without pictures: what is finished is not trained again, and
what was stopped goes on. A run's number is the mean return of its chosen checkpoint over test
starts on stock Gymnasium; a rung's is the interquartile mean of its runs, with a 95% bootstrap
interval over the training seeds. `--figures` draws each rung's learning curve beside the policy's.
"""

import argparse
import multiprocessing
from collections.abc import Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np

from touchdown import Config
from touchdown.config import presets
from touchdown.core import device, files, threads
from touchdown.core.seeding import TEST_STARTS
from touchdown.evaluation import evaluation as evaluations
from touchdown.policies import weights as policy_weights
from touchdown.runs import folder as folders
from touchdown.runs.folder import RunFolder
from touchdown.runs.provenance import cpu_name
from touchdown.runs.run import Run, evaluations_of
from touchdown.stats.summary import bootstrap_iqm
from touchdown.training.trainer import Trainer

RUNGS = [
    name
    for name, config in presets.PRESETS.items()
    # one that stops by itself does not take equal observations
    if config.env_id == "LunarLander-v3" and not config.training.stop_when_solved
]


def config_of(preset: str, seed: int, observations: int) -> Config:
    """A preset's settings with so many observations, looked at equally often."""
    config = presets.preset(preset)
    training = replace(
        config.training,
        episodes=1_000_000,
        max_env_steps=observations,
        validation_period=5_000,
        candidates=8,
    )
    return replace(config, seed=seed, training=training)


def train(job: tuple[str, int, int, Path]) -> str:
    """Train one rung with one seed, and fly its test starts once."""
    preset, seed, observations, runs = job
    device.use_default()
    folder = RunFolder(runs / f"{preset}-{seed}")
    if not folder.config_file.is_file():
        folder = folders.create(runs, config_of(preset, seed, observations), folder.name)
    if folder.evaluation.is_file():
        return folder.name
    with closing(Trainer(folder)) as trainer:
        trainer.run()
        policy = Run(folder).policy
        tested = evaluations.evaluate_policy(policy, TEST_STARTS[:100])
        evaluations.write_evaluations(
            folder.evaluation, [tested], policy_weights.facts_of(folder.best)
        )
    return folder.name


def finished(preset: str, seeds: Sequence[int], runs: Path) -> list[Run]:
    """The runs of a rung that have flown their test."""
    named = [Run(RunFolder(runs / f"{preset}-{seed}")) for seed in seeds]
    return [run for run in named if run.folder.evaluation.is_file()]


def table(rungs: Sequence[str], seeds: Sequence[int], runs: Path) -> str:
    """A Markdown table, a row a rung."""
    columns = ("rung", "IQM of the seeds [95%]", "mean", "each seed", "landed")
    lines = [f"| {' | '.join(columns)} |", "| --- |" + " ---: |" * (len(columns) - 1)]
    for rung in rungs:
        tested = finished(rung, seeds, runs)
        if not tested:
            continue
        summaries = [evaluations_of(run)[0].summary for run in tested]
        means = [summary.mean for summary in summaries]
        iqm = bootstrap_iqm(means)
        landed = np.mean([summary.outcomes.get("landed", 0.0) for summary in summaries])
        lines.append(
            f"| `{rung}` | **{iqm.value:.0f}** [{iqm.low:.0f}, {iqm.high:.0f}] "
            f"| {np.mean(means):.0f} | {', '.join(f'{mean:.0f}' for mean in means)} "
            f"| {landed:.0%} |"
        )
    return "\n".join(lines)


def draw(rungs: Sequence[str], seeds: Sequence[int], runs: Path, out: Path) -> None:
    """A picture a rung: validation returns over observations, beside the policy's."""
    out.mkdir(parents=True, exist_ok=True)
    curves = {rung: curves_of(finished(rung, seeds, runs)) for rung in rungs}
    for rung in rungs:
        if len(curves[rung]):
            beside = dict.fromkeys(("pilot", rung))
            shown = {name: curves[name] for name in beside if name in curves}
            rungs.save_rungs(out / f"{rung}.png", shown)


def curves_of(runs: Sequence[Run]) -> list[tuple[list[int], list[float]]]:
    """Observations and mean validation returns of each run."""
    curves: list[tuple[list[int], list[float]]] = []
    for run in runs:
        rows = files.read_jsonl(run.folder.validations)
        curves.append(([r["observations"] for r in rows], [r["mean_return"] for r in rows]))
    return curves


def main() -> None:
    """Train what is missing and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rungs", nargs="+", choices=RUNGS, default=RUNGS)
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2, 3, 4])
    parser.add_argument("--observations", type=int, default=180_000)
    parser.add_argument("--runs-dir", type=Path, default=Path("runs") / "ladder")
    parser.add_argument("--workers", type=int, default=threads.available())
    parser.add_argument("--table", action="store_true", help="print what is there, train nothing")
    parser.add_argument("--figures", type=Path, help="folder for a picture of each rung")
    args = parser.parse_args()
    jobs = [
        (rung, seed, args.observations, args.runs_dir) for rung in args.rungs for seed in args.seeds
    ]
    if not args.table:
        threads.share(args.workers)
        with multiprocessing.get_context("spawn").Pool(args.workers, maxtasksperchild=1) as pool:
            for count, name in enumerate(pool.imap_unordered(train, jobs, chunksize=1), start=1):
                print(f"{count}/{len(jobs)} {name}", flush=True)
    print(
        f"{cpu_name()}, one thread a run; seeds {args.seeds}, {args.observations:,} observations\n"
    )
    print(table(args.rungs, args.seeds, args.runs_dir))
    if args.figures:
        draw(args.rungs, args.seeds, args.runs_dir, args.figures)


if __name__ == "__main__":
    main()
