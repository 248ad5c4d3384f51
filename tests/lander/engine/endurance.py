"""Flies millions of steps, and says how much memory the process had before and after.

Run as a script: `python tests/lander/engine/endurance.py 50000000`.
"""

import os
import pickle
import sys
from pathlib import Path

import numpy as np

from touchdown.lander.vector import LanderVectorEnv, StepArrays

NUM_ENVS = 1_024
WARM_UP = 1_000  # steps of each lander, after which every buffer has its size


def resident() -> int:
    """Bytes of memory that this process has."""
    pages = Path("/proc/self/statm").read_text("utf-8").split()[1]
    return int(pages) * os.sysconf("SC_PAGE_SIZE")


def growth(steps: int) -> tuple[int, int]:
    """Bytes of memory after a warm-up, and after this many steps more, with random actions.

    Now and then the landers are restored, copied and pickled.
    """
    env = LanderVectorEnv(NUM_ENVS)
    env.reset(seed=0)
    rng = np.random.default_rng(0)
    out = StepArrays.empty(NUM_ENVS)
    before = 0
    for step in range(WARM_UP + -(-steps // NUM_ENVS)):
        if step == WARM_UP:
            before = resident()
        env.step(rng.integers(0, 4, NUM_ENVS), out=None if step % 10 == 0 else out)
        if step % 50 == 0:
            env.restore(1, env.snapshot(0))
            env.copy_state(2, [3, 4])
        if step % 400 == 0:
            env = pickle.loads(pickle.dumps(env))  # noqa: S301 - our own
    return before, resident()


def main(steps: int) -> None:
    before, after = growth(steps)
    sys.stdout.write(f"{steps:,} steps: {before / 1e6:.1f} MB before, {after / 1e6:.1f} MB after\n")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 50_000_000)
