"""Finished runs that nobody trained."""

import json

from touchdown.evaluation.evaluation import Evaluation, write_evaluations
from touchdown.evaluation.evaluator import EpisodeResult
from touchdown.policies.facts import WeightsFacts
from touchdown.runs.run import CURVE
from touchdown.stats.summary import summarise
from touchdown.studies.work import LAST

LANDER = "LunarLander-v3"


def evaluation(returns):
    episodes = [
        EpisodeResult(1_000_000 + i, value, 300, "landed" if value >= 200 else "crashed", 20.0)
        for i, value in enumerate(returns)
    ]
    outcomes = [episode.outcome for episode in episodes]
    counted = [300] * len(returns), outcomes, [20.0] * len(returns), 200.0
    return Evaluation("made up", LANDER, episodes, summarise(returns, *counted))


def lines(path, rows):
    path.write_text("".join(json.dumps(row) + "\n" for row in rows))


def write_validations(path, means):
    """Validations of a run: observations, and the mean return then."""
    lines(
        path / "validations.jsonl",
        [
            {
                "observations": at,
                "episode": 0,
                "mean_return": mean,
                "returns": [mean],
                "time_limit_share": 0.0,
            }
            for at, mean in means
        ],
    )


def write_run(path, returns=(100.0, 300.0), last=None):
    """A finished run of 4,000 observations and 40 seconds, half of whose episodes hovered."""
    path.mkdir(parents=True)
    ends = (1_000, 2_000, 3_000, 4_000)
    outcomes = ("timed out", "timed out", "crashed", "landed")
    lines(
        path / "episodes.jsonl",
        [
            {
                "episode": number,
                "observations": end,
                "episode_return": 0.0,
                "steps": 1_000,
                "outcome": outcome,
                "epsilon": 0.1,
                "seconds": end / 100,
            }
            for number, (end, outcome) in enumerate(zip(ends, outcomes, strict=True), start=1)
        ],
    )
    write_validations(path, ((0, 0.0), (2_000, 100.0), (3_500, 250.0)))
    write_evaluations(path / "evaluation.json", [evaluation(returns)], WeightsFacts())
    if last is not None:
        write_evaluations(path / LAST, [evaluation(last)], WeightsFacts())
    (path / "checkpoints").mkdir()
    (path / CURVE).touch()
