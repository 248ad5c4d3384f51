"""Presets over several training seeds, on test starts: what one seed cannot say.

    python benchmarks/seeds.py policy paper-best --seeds 0 1 2 3 4

Every run is an ordinary run folder; what is finished already is not trained again, and what was
stopped goes on. Test starts are flown once, by the checkpoint that validation chose.
"""

import argparse
import multiprocessing
import statistics
from collections.abc import Sequence
from pathlib import Path

from scipy import stats

import touchdown
from touchdown.core import files, threads
from touchdown.policies import weights as policy_weights
from touchdown.runs.provenance import cpu_name
from touchdown.runs.run import evaluations_of


def train(job: tuple[str, int, Path]) -> str:
    """Train one preset with one seed to its last picture, in a process of its own."""
    preset, seed, runs = job
    name = f"{preset}-{seed}"
    if not (runs / name / "config.toml").is_file():
        return touchdown.train(preset, seed=seed, name=name, runs_dir=runs).name
    run = touchdown.show(name, runs_dir=runs)
    if run.status == "unfinished":
        touchdown.resume(name, runs_dir=runs)
    return name


def mean_and_interval(values: Sequence[float]) -> str:
    """A mean over seeds with its 95% interval by Student's t."""
    mean = statistics.fmean(values)
    if len(values) < 2:
        return f"{mean:.1f}"
    half = float(stats.t.ppf(0.975, len(values) - 1)) * statistics.stdev(values)
    half /= len(values) ** 0.5
    return f"{mean:.1f} [{mean - half:.0f}, {mean + half:.0f}]"


def table(presets: Sequence[str], seeds: Sequence[int], runs: Path) -> str:
    """A Markdown table of the finished seeds of each preset, and a row for all of them."""
    columns = ("preset", "seed", "test return, mean ± sd", "IQM", "worst 5%", "landed")
    columns += ("share ≥ threshold", "observations", "training, s")
    lines = [f"| {' | '.join(columns)} |", "| --- |" + " ---: |" * (len(columns) - 1)]
    for preset in presets:
        means: list[float] = []
        for seed in seeds:
            if not (runs / f"{preset}-{seed}" / "evaluation.json").is_file():
                continue
            run = touchdown.show(f"{preset}-{seed}", runs_dir=runs)
            summary = evaluations_of(run)[0].summary
            last = files.read_jsonl(run.folder.episodes)[-1]
            # a preset that stops when its world is solved says when it knew, validation counted
            solved = policy_weights.facts_of(run.folder.best).solved_seconds
            seconds = last["seconds"] if solved is None else solved
            means.append(summary.mean)
            lines.append(
                f"| {preset} | {seed} | {summary.mean:.1f} ± {summary.sd:.0f} "
                f"| {summary.iqm.value:.1f} | {summary.worst:.1f} "
                f"| {summary.outcomes.get('landed', 0.0):.0%} | {summary.share_solved:.1%} "
                f"| {last['observations']:,} | {seconds:.1f} |"
            )
        if means:
            lines.append(f"| **{preset}** | all | **{mean_and_interval(means)}** | | | | | | |")
    return "\n".join(lines)


def main() -> None:
    """Train what is missing and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("presets", nargs="+", choices=list(touchdown.PRESETS))
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2, 3, 4])
    parser.add_argument("--runs-dir", type=Path, default=Path("runs") / "seeds")
    parser.add_argument("--workers", type=int, default=threads.available())
    parser.add_argument("--table", action="store_true", help="print what is there, train nothing")
    args = parser.parse_args()
    jobs = [(preset, seed, args.runs_dir) for preset in args.presets for seed in args.seeds]
    if not args.table:
        threads.share(args.workers)
        with multiprocessing.get_context("spawn").Pool(args.workers, maxtasksperchild=1) as pool:
            for count, name in enumerate(pool.imap_unordered(train, jobs, chunksize=1), start=1):
                print(f"{count}/{len(jobs)} {name}", flush=True)
    each = max(1, threads.available() // args.workers)
    print(f"{cpu_name()}, {each} threads a run, {args.workers} at a time; seeds {args.seeds}")
    print(
        "In bold the mean over seeds of the mean test return, with its 95% interval by Student's t."
    )
    print()
    print(table(args.presets, args.seeds, args.runs_dir))


if __name__ == "__main__":
    main()
