"""The paper's studies and claims, at two scales and in several readings."""

from touchdown.studies.paper.experiments import Topic, baseline_jobs, pid_jobs, studies, topics
from touchdown.studies.paper.levels import BEST, FIRST_SEED, LOOKS, PLAN_COMMIT, SCALES, Scale

__all__ = [
    "BEST",
    "FIRST_SEED",
    "LOOKS",
    "PLAN_COMMIT",
    "SCALES",
    "Scale",
    "Topic",
    "baseline_jobs",
    "pid_jobs",
    "studies",
    "topics",
]
