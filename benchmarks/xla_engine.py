"""Steps without Python in the loop: the engine as a custom call in XLA's compiled loop.

    python benchmarks/xla_engine.py --num-envs 64

Four ways to step environments with the greedy policy of one network, in turns, on one core: the
engine alone, with recorded actions; the training loop, in Python; a loop with only the calls of the
engine and of the fused network; and `jax.lax.scan` over JAX's network and the engine as an XLA
custom call, which is compiled here because it is only an experiment.
"""

import argparse
import ctypes
import statistics
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from touchdown.agents.learners.fused import FusedNetwork
from touchdown.agents.networks import QNetwork
from touchdown.config.sections import NetworkConfig
from touchdown.core import device
from touchdown.envs.pool import make_pool
from touchdown.lander._engine import Batch
from touchdown.runs.provenance import cpu_name
from touchdown.training.loop import begin, interact

CSRC = Path(__file__).parents[1] / "csrc"
SHAPE = NetworkConfig(hidden_sizes=(64, 64), layer_norm=True)
D, A = 8, 4
CALL = Path(__file__).with_name("xla_engine") / "engine_call.cpp"


def compiled(folder: Path) -> ctypes.CDLL:
    """The custom call with its own copy of the engine, built for this machine."""
    out = folder / "engine_call.so"
    engine = ("lander", "batch", "kernel", "lane_kernel")  # the kernel of the baseline alone
    sources = [CALL, *(CSRC / "engine" / f"{part}.cpp" for part in engine)]
    sources += [CSRC / "simd" / "instruction_set.cpp"]
    flags = ["-std=c++20", "-O2", "-ffp-contract=off", "-march=native", "-mno-fma", "-Wno-psabi"]
    headers = [f"-I{CSRC}", "-isystem", jax.ffi.include_dir()]
    command = ["c++", "-shared", "-fPIC", *flags, *headers, *map(str, sources), "-o", str(out)]
    subprocess.run(command, check=True)
    return ctypes.CDLL(str(out))


class Bare:
    """A loop of only two calls; ended episodes are reset one step later."""

    def __init__(self, count: int, network: FusedNetwork, params: Any) -> None:
        self._batch = Batch(count)
        for index in range(count):
            self._batch.seed(index, index)
        self._network = network
        self._params = np.asarray(params)
        self._arrays: tuple[Any, ...] = (
            np.zeros(count, np.int64),
            np.zeros((count, D), np.float32),
            np.zeros(count),
            np.zeros(count, np.bool_),
            np.full(count, 2, np.uint8),
        )
        self._q = np.zeros((count, A), np.float32)

    def fly(self, steps: int) -> list[tuple[Any, Any]]:
        """Act greedily; return the actions and tasks of each step."""
        actions, observations, _, terminated, tasks = self._arrays
        flown: list[tuple[Any, Any]] = []
        for _ in range(steps):
            self._network.perceptron.values(self._params, observations, self._q)
            self._q.argmax(1, out=actions)
            flown.append((actions.copy(), tasks.copy()))
            self._batch.step(*self._arrays)
            np.add(terminated, 1, out=tasks, casting="unsafe")
        return flown

    def repeat(self, flown: list[tuple[Any, Any]]) -> None:
        """Repeat recorded steps, without a network."""
        for actions, tasks in flown:
            self._batch.step(actions, *self._arrays[1:4], tasks)


class Greedy:
    """The part of an agent that `interact` needs."""

    epsilon = 0.0

    def __init__(self, network: FusedNetwork, params: Any) -> None:
        self._values, self._params = network.values_of_each, params

    def act(self, observations: Any) -> Any:
        """The greedy actions."""
        return np.asarray(self._values(self._params, observations)).argmax(1)

    def observe(self, *_: Any) -> None:
        """Learn nothing."""


def in_xla(library: ctypes.CDLL, count: int, network: QNetwork, params: Any) -> Any:
    """A function that runs a given number of steps in one compiled call."""
    library.make_flock.restype = ctypes.c_void_p
    library.make_flock.argtypes = [ctypes.c_int64, ctypes.c_int64]
    address = library.make_flock(count, 1)
    advance = jax.ffi.ffi_call(
        "advance_flock",
        (
            jax.ShapeDtypeStruct((count, D), jnp.float32),
            jax.ShapeDtypeStruct((count,), jnp.float32),
            jax.ShapeDtypeStruct((count,), jnp.bool_),
        ),
        has_side_effect=True,
    )

    def step(observations: jax.Array, _: None) -> tuple[jax.Array, jax.Array]:
        actions = network.apply(params, observations).argmax(1).astype(jnp.int32)
        observations, rewards, _terminated = advance(actions, address=np.int64(address))
        return observations, rewards.sum()

    def fly(observations: jax.Array, steps: int) -> tuple[jax.Array, jax.Array]:
        return jax.lax.scan(step, observations, None, length=steps)

    return jax.jit(fly, static_argnums=1)


def seconds(call: Callable[[], object]) -> float:
    """Wall-clock seconds of one call."""
    began = time.perf_counter()
    call()
    return time.perf_counter() - began


def main() -> None:
    """Print the microseconds per step of all environments, for each way."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--num-envs", type=int, default=64)
    parser.add_argument("--steps", type=int, default=1_000)
    parser.add_argument("--rounds", type=int, default=9)
    args = parser.parse_args()
    device.start()
    count, steps = args.num_envs, args.steps
    plain = QNetwork(D, A, SHAPE)
    fused = FusedNetwork(plain)
    params = plain.init(jax.random.key(0))
    pool = make_pool("LunarLander-v3", count, "exact")
    episodes = begin(pool, int, count)
    training = interact(Greedy(fused, params), pool, int, episodes)
    with tempfile.TemporaryDirectory() as folder:
        library = compiled(Path(folder))
    jax.ffi.register_ffi_target("advance_flock", jax.ffi.pycapsule(library.advance_flock))
    fly = in_xla(library, count, plain, params)
    observations = jnp.zeros((count, D))
    flown = Bare(count, fused, params).fly(steps)

    def through_xla() -> None:
        nonlocal observations
        observations = fly(observations, steps)[0].block_until_ready()

    ways: dict[str, Callable[[], object]] = {
        "the engine alone": lambda: Bare(count, fused, params).repeat(flown),
        "training's loop": lambda: [next(training) for _ in range(steps)],
        "two calls in a bare loop": lambda: Bare(count, fused, params).fly(steps),
        "a custom call in XLA's loop": through_xla,
    }
    for call in ways.values():
        call()
    taken = {name: [seconds(call)] for name, call in ways.items()}
    for _ in range(args.rounds - 1):
        for name, call in ways.items():
            taken[name].append(seconds(call))
    print(f"{cpu_name()}, one core; {count} environments, network {list(SHAPE.hidden_sizes)}\n")
    print("| method | µs per step of all environments, median | minimum | maximum |")
    print("| --- | ---: | ---: | ---: |")
    for name, each in taken.items():
        micro = [1e6 * one / steps for one in each]
        middle = statistics.median(micro)
        print(f"| {name} | {middle:.0f} | {min(micro):.0f} | {max(micro):.0f} |")


if __name__ == "__main__":
    main()
