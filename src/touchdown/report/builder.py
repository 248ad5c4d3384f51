"""Builds the sections of a page: draws figures and films into its folder from records."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from touchdown.envs import flight as flights
from touchdown.render import film as films
from touchdown.report import pictures, tables
from touchdown.report.page import Film, Picture, Section
from touchdown.runs.folder import RunFolder
from touchdown.studies.claims import Decision
from touchdown.studies.metrics import METRICS
from touchdown.studies.results import StudyResults

STEPS = 3
"""Steps of a section, for progress: its figures, its film, its tables."""
_FIGURES = "figures"
# a page has a film per section, so each is a third of the size of a single film
_FILM_FPS, _FILM_SCALE = 12, 0.6


class Builder:
    """Draws the figures and films of sections into a folder.

    Args:
        out: the folder to write into.
        beside: the folder in which the page will be, for links to the runs; None makes no links.
        on_step: called after each of the `STEPS` of a section with its name.
    """

    def __init__(
        self, out: Path, *, beside: Path | None, on_step: Callable[[str], object] = lambda _: None
    ) -> None:
        self.figures = out / _FIGURES
        self.beside = beside
        self.step = on_step
        self._filmed: set[Path] = set()
        self.figures.mkdir()

    def all_steps(self, name: str) -> None:
        """Report all steps of a section that is not made here, or not at all."""
        for _ in range(STEPS):
            self.step(name)

    def section(
        self,
        name: str,
        title: str,
        lead: str,
        results: StudyResults,
        metric: str,
        decisions: Sequence[Decision],
        lines: Mapping[str, float],
        *,
        training: str = "",
        with_curves: bool = True,
    ) -> Section:
        """A section on training runs: figures, claims, levels, runs, and a flight of the best run.

        Args:
            name: the section's id, and the stem of its files.
            title: title of the section.
            lead: first sentences of the section.
            results: results of a study with at least one finished run.
            metric: metric that is shown and compared.
            decisions: decisions on claims.
            lines: numbers to compare with, by name.
            training: what to show of the training episodes, `training_returns` or
                `training_steps`; "" for nothing.
            with_curves: whether to show the levels over training.
        """
        stem = self.figures / name
        shown = [pictures.save_picture(title, results, metric, lines, stem)]
        if with_curves and len(results.study.factors) == 1:
            shown += self._over_training(name, title, results, metric)
        if training:
            own = self.figures / f"{name}-{training.replace('_', '-')}"
            shown.append(pictures.save_training(title, results, training, own))
        self.step(name)
        shot = self._film_of_best(results, name, metric)
        self.step(name)
        shown_tables = (
            *tables.level_tables(results, metric),
            tables.run_table(results, self.beside),
        )
        self.step(name)
        return Section(
            id=name,
            title=title,
            lead=" ".join((*filter(None, [lead]), *gaps(results))),
            claims=tables.claim_rows(decisions),
            pictures=tuple(shown),
            films=shot,
            tables=shown_tables,
        )

    def _over_training(
        self, name: str, title: str, results: StudyResults, metric: str
    ) -> list[Picture]:
        """Pictures of the levels of one factor over training."""
        over = self.figures / f"{name}-over-training"
        by_words = all(level.position is None for level in results.study.factors[0].levels)
        if metric.startswith("hover"):
            return pictures.save_all_curves(title, results, "hovering", over) if by_words else []
        if by_words:
            shown = pictures.save_all_curves(title, results, "validations", over)
        else:
            shown = [pictures.save_panels(title, results, over)]
        return shown + pictures.save_reached(title, results, self.figures / f"{name}-reached")

    def _film_of_best(self, results: StudyResults, name: str, metric: str) -> tuple[Film, ...]:
        """The median flight of the run with the highest value, if its flight could show why."""
        if metric in ("overestimation", "rewarded_share"):
            return ()
        best = max(results.runs, key=lambda run: getattr(run, metric))
        who = f"{' · '.join(best.labels)}, seed {best.seed}"
        return self.film(best.folder, name, who, METRICS[metric])

    def film(self, folder: RunFolder, name: str, who: str, most: str) -> tuple[Film, ...]:
        """A film of the recorded flight with the median test return.

        Args:
            folder: folder with the recorded flights.
            name: name of the file.
            who: name of the policy.
            most: metric in which it has the highest value of its section.

        Returns:
            The film; empty if no flight is recorded, or if an earlier section shows it.

        Raises:
            UserError: the recorded flights are broken, or the film cannot be written.
        """
        if folder.path in self._filmed:
            return ()
        recorded = flights.load_flights(folder.flights) if folder.flights.is_file() else []
        if not recorded:
            return ()
        self._filmed.add(folder.path)
        flight = dataclasses.replace(recorded[0], policy=who)
        path = self.figures / f"{name}.gif"
        films.write_gif(flight, path, _FILM_FPS, _FILM_SCALE)
        return (
            Film(
                path,
                f"{who}: {flight.outcome} after {flight.steps} steps",
                f"{who}, which has the highest {most}. Its median test episode, from start "
                f"{flight.seed}: {flight.outcome}, return {flight.episode_return:.0f}.",
            ),
        )


def gaps(results: StudyResults) -> list[str]:
    """Sentences on runs that are missing or failed."""
    found: list[str] = []
    if results.missing:
        found.append(f"{results.missing} of {results.planned} runs are not done yet.")
    if results.failed:
        reasons = "; ".join(sorted(set(results.failed.values())))
        found.append(f"{len(results.failed)} runs failed: {reasons}.")
    return found
