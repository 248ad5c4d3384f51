"""Finished runs that nobody trained."""

import json

import numpy as np
from safetensors.numpy import save_file

from touchdown.envs.flight import Flight, Terrain, save_flights
from touchdown.evaluation.evaluation import Evaluation, write_evaluations
from touchdown.evaluation.evaluator import EpisodeResult
from touchdown.evaluation.paths import save_paths
from touchdown.policies.facts import WeightsFacts
from touchdown.runs.folder import RunFolder
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
    """Validations of a run: env steps, and the mean return then."""
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


def write_run(path, returns=(100.0, 300.0), last=None, recorded=True):
    """A finished run of 4,000 env steps and 40 seconds, half of whose episodes hovered.

    Its flights are one that stands still for two steps, and paths as long.
    """
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
    if returns is not None:
        write_evaluations(path / "evaluation.json", [evaluation(returns)], WeightsFacts())
    if last is not None:
        write_evaluations(path / LAST, [evaluation(last)], WeightsFacts())
    (path / "checkpoints").mkdir()
    write_best(path)
    if recorded:
        record(RunFolder(path))
    (path / CURVE).touch()


def write_best(path, final_validation_return=250.0):
    facts = json.dumps({"final_validation_return": final_validation_return})
    texts = {"format_version": "2", "env_id": LANDER, "preset": "custom", "seed": "0"}
    save_file({}, RunFolder(path).best, {**texts, "network": "{}", "facts": facts})


def flight(points=((0.0, 1.0), (0.0, 1.0), (0.0, 1.0)), seed=1_000_000):
    """The lander's flight through these places: x and y of its observations."""
    observations = np.zeros((len(points), 8), np.float32)
    observations[:, :2] = points
    steps = len(points) - 1
    xs = np.linspace(0.0, 20.0, 11)
    return Flight(
        env_id=LANDER,
        policy="made up",
        seed=seed,
        observations=observations,
        actions=np.zeros(steps, np.int64),
        rewards=np.ones(steps),
        outcome="timed out",
        steps_per_second=50,
        bodies=np.full((len(points), 3, 3), 8.0, np.float32),
        terrain=Terrain(xs, np.full(11, 3.0), 8.0, 12.0, 3.0),
    )


def record(folder, height=1.0):
    """The files of recorded flights: one flight, and paths at a height from two starts."""
    save_flights(folder.flights, [flight()])
    save_paths(
        folder.paths,
        {start: np.full((3, 2), (0.0, height), np.float32) for start in (1_000_000, 1_000_001)},
    )
