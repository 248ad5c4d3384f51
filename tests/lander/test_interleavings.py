"""Any sequence of operations on a batch of landers leaves each lander as a stock one would be."""

import gymnasium
import numpy as np
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import Bundle, RuleBasedStateMachine, initialize, invariant, rule

from touchdown.lander.vector import LanderVectorEnv

LIMIT = 120  # steps: beyond the first ground contact of a falling lander
LANDERS = st.integers(0, 3)


class StockTwin:
    """A stock lander that can be copied: the copy repeats the whole past of the original."""

    def __init__(self, past: list[tuple[str, int | None]]) -> None:
        self.past: list[tuple[str, int | None]] = []
        self._env = gymnasium.make("LunarLander-v3", disable_env_checker=True)
        self._env = gymnasium.wrappers.TimeLimit(self._env.unwrapped, LIMIT)
        self.seen: tuple = ()
        for operation, value in past:
            self.do(operation, value)

    def do(self, operation: str, value: int | None) -> None:
        self.past.append((operation, value))
        if operation == "reset" or self.ended:  # the autoreset of the next step
            o, _ = self._env.reset(seed=value if operation == "reset" else None)
            self.seen = (o, 0.0, False, False)
        else:
            o, reward, terminated, truncated, _ = self._env.step(value)
            self.seen = (o, float(reward), terminated, truncated)

    @property
    def ended(self) -> bool:
        return bool(self.seen) and (self.seen[2] or self.seen[3])


class Interleavings(RuleBasedStateMachine):
    snapshots = Bundle("snapshots")

    @initialize(count=st.integers(1, 4), seed=st.integers(0, 2**40))
    def make(self, count: int, seed: int) -> None:
        self.env = LanderVectorEnv(count, max_episode_steps=LIMIT)
        self.twins = [StockTwin([("reset", seed + i)]) for i in range(count)]
        self.observations = self.env.reset(seed=seed)[0]

    def index(self, lander: int) -> int:
        return lander % self.env.num_envs

    @rule(
        length=st.integers(1, 60), engine=st.sampled_from([0, 1, 2, 3, None]), seed=st.integers(0)
    )
    def fly(self, length: int, engine: int | None, seed: int) -> None:
        rng = np.random.default_rng(seed)
        for _ in range(length):
            count = self.env.num_envs
            actions = rng.integers(0, 4, count) if engine is None else np.full(count, engine)
            *results, _ = self.env.step(actions)
            self.observations = results[0]
            for i, twin in enumerate(self.twins):
                twin.do("step", int(actions[i]))
                for ours, theirs in zip(results[1:], twin.seen[1:], strict=True):
                    assert ours[i] == theirs
                assert results[0][i].tobytes() == twin.seen[0].tobytes()

    @rule(lander=LANDERS, seed=st.none() | st.integers(0, 2**70))
    def reset_one(self, lander: int, seed: int | None) -> None:
        i = self.index(lander)
        mask = np.arange(self.env.num_envs) == i
        seeds = [seed if chosen else 1 for chosen in mask]  # the seeds of the others are not used
        self.observations, _ = self.env.reset(seed=seeds, options={"reset_mask": mask})
        self.twins[i].do("reset", seed)

    @rule(target=snapshots, lander=LANDERS)
    def save(self, lander: int) -> tuple[bytes, list]:
        i = self.index(lander)
        return self.env.snapshot(i), list(self.twins[i].past)

    @rule(lander=LANDERS, saved=snapshots)
    def restore(self, lander: int, saved: tuple[bytes, list]) -> None:
        i = self.index(lander)
        self.env.restore(i, saved[0])
        self.twins[i] = StockTwin(saved[1])
        self.observations[i] = self.twins[i].seen[0]

    @rule(lander=LANDERS, other=LANDERS)
    def copy(self, lander: int, other: int) -> None:
        i, j = self.index(lander), self.index(other)
        self.env.copy_state(i, [j])
        self.twins[j] = StockTwin(self.twins[i].past)
        self.observations[j] = self.observations[i]

    @rule(count=st.integers(1, 4))
    def resize(self, count: int) -> None:
        """A batch of another size, with the states of the old landers."""
        old, pasts = self.env, [twin.past for twin in self.twins]
        self.env = LanderVectorEnv(count, max_episode_steps=LIMIT)
        sources = [i % old.num_envs for i in range(count)]
        for i, source in enumerate(sources):
            self.env.restore(i, old.snapshot(source))
        self.twins = [StockTwin(pasts[source]) for source in sources]
        self.observations = self.observations[sources]

    @invariant()
    def every_lander_is_where_its_twin_is(self) -> None:
        if not hasattr(self, "env"):
            return
        for i, twin in enumerate(self.twins):
            assert self.observations[i].tobytes() == twin.seen[0].tobytes()
            stock = twin._env.unwrapped
            bodies = [stock.lander, *stock.legs]
            states = self.env.states()
            places = np.array([tuple(body.position) for body in bodies], np.float32)
            assert states.positions[i].tobytes() == places.tobytes()


TestInterleavings = Interleavings.TestCase
TestInterleavings.settings = settings(
    max_examples=100,
    stateful_step_count=15,
    deadline=None,
    derandomize=True,
    suppress_health_check=list(HealthCheck),
)
