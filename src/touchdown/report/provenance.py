"""Facts on a page about the origin of its numbers."""

import platform
from collections import Counter
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime

from touchdown.core import installation, threads
from touchdown.lander import engine as engines
from touchdown.runs.provenance import cpu_name
from touchdown.studies.pid_results import PidResult
from touchdown.studies.results import StudyResults

_PACKAGES = ("gymnasium", "jax", "numpy", "scipy", "statsmodels")


def page_facts(
    results: Mapping[str, StudyResults], tuned: Sequence[PidResult], scale: str
) -> tuple[tuple[str, str], ...]:
    """Amounts of studies, runs, steps and time.

    Args:
        results: results by study.
        tuned: PID tunings.
        scale: scale of the paper's studies; "" for a user's study.
    """
    runs = {run.path: run for each in results.values() for run in each.runs}
    hours = sum(run.seconds for run in runs.values()) / 3600
    facts = [
        ("studies", str(len(results) + bool(tuned))),
        ("training runs", str(len(runs))),
        ("environment steps", f"{sum(run.env_steps for run in runs.values()) / 1e6:.1f} million"),
        ("hours of training", f"{hours:.1f}"),
    ]
    if scale:
        facts.append(("scale", scale))
    return tuple(facts)


def provenance_of(
    command: str, results: Mapping[str, StudyResults], scale: str
) -> tuple[tuple[str, str], ...]:
    """The command, the machine, the test, and the settings.

    Args:
        command: the command that runs the studies and writes the page.
        results: results by study.
        scale: scale of the paper's studies; "" for a user's study.
    """
    bases = {name: each.study.base_cell().config.digest for name, each in results.items()}
    facts = [
        ("made by", command),
        *machine_facts(),
        *_origins(results),
        ("test", _test_text(results)),
        ("base settings", ", ".join(f"{name} {digest}" for name, digest in bases.items())),
    ]
    if scale:
        facts.append(("scale", scale))
    return tuple(facts)


def _origins(results: Mapping[str, StudyResults]) -> list[tuple[str, str]]:
    """What made the runs, as far as it is recorded."""
    runs = {run.name: run.origin for each in results.values() for run in each.runs}
    processors = Counter(
        f"{each.cpu}{f' with {each.simd}' if each.simd else ''}"
        for each in runs.values()
        if each.cpu
    )
    commits = Counter(each.git_commit[:12] for each in runs.values() if each.git_commit)
    return [
        (name, ", ".join(f"{what} ({count} runs)" for what, count in counts.most_common()))
        for name, counts in (("trained on", processors), ("trained at commit", commits))
        if counts
    ]


def machine_facts() -> tuple[tuple[str, str], ...]:
    """When, where and with which versions a page is written."""
    return (
        ("written", datetime.now(UTC).strftime("%Y-%m-%d")),
        (
            "machine",
            f"{cpu_name()}, {threads.available()} cores, Python {platform.python_version()}",
        ),
        ("repeats", "the same bytes on this machine; another kind of processor rounds differently"),
        ("versions", ", ".join(map(" ".join, installation.versions(_PACKAGES).items()))),
        ("lander", f"trained on {engines.engine_in_use()}, tested on stock Gymnasium"),
    )


def _test_text(results: Mapping[str, StudyResults]) -> str:
    counts = {
        cell.config.training.test_episodes
        for each in results.values()
        for cell in each.study.cells()
    }
    if counts == {0}:
        return "none: runs are compared on validation starts"
    starts = " or ".join(map(str, sorted(counts)))
    return f"{starts} greedy episodes per run, from starts that were not used to select checkpoints"
