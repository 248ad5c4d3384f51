"""Compares updates of the fused kernel with JAX's, and with the minimal time of their arithmetic.

    python benchmarks/fused_update.py --rounds 9

The floor is the time of an update's multiplications and additions at the rate of NumPy's product of
two large matrices with the same instruction set, measured between the updates; no kernel on this
machine is faster. All sides take turns on one core. Each instruction set that the processor has
gets a process and a table of its own; JAX uses what its libraries choose.
"""

import argparse
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from typing import NamedTuple

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # NumPy reads this on import

import jax
import numpy as np

from touchdown.agents.learners._fused import simd
from touchdown.agents.learners.fused import FusedLearner
from touchdown.agents.learners.fused_network import FusedNetwork
from touchdown.agents.learners.state import LearnerState, init_state
from touchdown.agents.learners.update import make_update
from touchdown.agents.networks import QNetwork
from touchdown.config.config import Config
from touchdown.config.sections import LearningConfig, NetworkConfig
from touchdown.core import device
from touchdown.replay.transition import transition_dtype
from touchdown.runs.provenance import cpu_name

D, A = 8, 4


class Case(NamedTuple):
    """A row of the table."""

    hidden: tuple[int, ...]
    batch_size: int
    double: bool = False
    layer_norm: bool = False
    quantiles: int = 0
    atoms: int = 0
    noisy: bool = False

    def __str__(self) -> str:
        """The network and what its update has besides Q-learning."""
        parts = (
            ("double", self.double),
            ("layer norm", self.layer_norm),
            (f"{self.quantiles} quantiles", self.quantiles),
            (f"{self.atoms} atoms", self.atoms),
            ("noisy", self.noisy),
        )
        return ", ".join([str(list(self.hidden)), *(name for name, has in parts if has)])

    @property
    def flop(self) -> int:
        """Operations of one update, without noise and what is done with the network's outputs.

        Forward at o_tm1 and o_t; backward to all weights, and to all inputs but o. A multiplication
        with its addition counts as two.
        """
        outputs = A * max(1, self.quantiles, self.atoms)
        layers = list(zip((D, *self.hidden), (*self.hidden, outputs), strict=True))
        whole = sum(fan_in * fan_out for fan_in, fan_out in layers)
        passes = (4 + self.double) * whole - layers[0][0] * layers[0][1]
        return 2 * self.batch_size * passes


CASES = (
    Case((64, 64), 64, layer_norm=True),
    Case((64, 64), 128, double=True),
    Case((128, 128), 256, double=True),
    Case((100, 100, 100), 64),
    Case((100, 100, 100), 64, quantiles=32),
    Case((100, 100, 100), 64, atoms=51),
    Case((100, 100, 100), 64, noisy=True),
    Case((400, 300), 128),
)
SETS = {"avx512": "SkylakeX", "avx2": "Haswell"}
"""Instruction sets, and a processor that has no wider one, as OpenBLAS calls it."""


def seconds(call: Callable[[], object]) -> float:
    """Wall-clock seconds of one call."""
    began = time.perf_counter()
    call()
    return time.perf_counter() - began


def product_rate(size: int = 768) -> float:
    """Operations per second of NumPy's product of two matrices, the best of a few."""
    matrix = np.ones((size, size), np.float32)
    return 2 * size**3 / min(seconds(lambda: matrix @ matrix) for _ in range(3))


def measure(case: Case, args: argparse.Namespace) -> list[tuple[float, float, float]]:
    """Microseconds of JAX's update, of the fused one and of the floor, for each round."""
    batch_size = case.batch_size
    shape = NetworkConfig(
        hidden_sizes=case.hidden,
        layer_norm=case.layer_norm,
        quantiles=case.quantiles,
        atoms=case.atoms,
        noisy=case.noisy,
    )
    config = LearningConfig(
        double=case.double,
        loss="huber",
        max_grad_norm=10.0,
        target_period=1000,
        learning_rate=1e-4,
    )
    network, rng = QNetwork(D, A, shape), np.random.default_rng(0)
    records = np.zeros(args.updates * batch_size, transition_dtype(D))
    records["o_tm1"], records["o_t"] = rng.normal(size=(2, len(records), D))
    records["a_tm1"], records["r_t"] = rng.integers(A, size=len(records)), 1.0
    packed = records.view(np.float32).reshape(args.updates, batch_size, -1)
    seen = packed[0, :1, :D]
    update = make_update(network, config)

    def step(state: LearnerState, batch: jax.Array) -> tuple[LearnerState, None]:
        noise = jax.random.key(0) if case.noisy else None
        return update(state, batch, None, measured=False, noise=noise).state, None

    scan = jax.jit(lambda state, packed: jax.lax.scan(step, state, packed)[0])
    start = init_state(network, config, 0)
    learner = FusedLearner(FusedNetwork(D, A, shape), Config(network=shape, learning=config))

    def learn() -> None:
        learner.update(packed, None, seen, 0, measured=True)

    jax.block_until_ready(scan(start, packed))
    learn()
    return [
        (
            1e6 * seconds(lambda: jax.block_until_ready(scan(start, packed))) / args.updates,
            1e6 * seconds(learn) / args.updates,
            1e6 * case.flop / product_rate(),
        )
        for _ in range(args.rounds)
    ]


def table(args: argparse.Namespace) -> None:
    """Time everything with one instruction set and print a table."""
    print(f"{cpu_name()}, one core, {simd()}\n")
    print("| network | batch | JAX, µs | fused, µs | floor, µs | JAX / fused | fused / floor |")
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: |")
    for case in CASES:
        rounds = measure(case, args)
        numbers = " | ".join(f"{statistics.median(side):.0f}" for side in zip(*rounds, strict=True))
        gain = statistics.median(theirs / ours for theirs, ours, _ in rounds)
        above = statistics.median(ours / floor for _, ours, floor in rounds)
        print(
            f"| {case} | {case.batch_size} | {numbers} | {gain:.2f} | {above:.2f} |",
            flush=True,
        )


def main() -> None:
    """Run this program once for each instruction set."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--updates", type=int, default=200)
    parser.add_argument("--only", choices=SETS, help="one instruction set, in this process")
    args = parser.parse_args()
    widest = simd()
    if args.only or widest not in SETS:
        device.start()
        table(args)
        return
    for name in SETS if widest == "avx512" else [widest]:
        settings = {"TOUCHDOWN_SIMD": name, "OPENBLAS_CORETYPE": SETS[name]}
        subprocess.run(
            [sys.executable, __file__, *sys.argv[1:], "--only", name],
            env={**os.environ, **settings},
            check=True,
        )
        print()


if __name__ == "__main__":
    main()
