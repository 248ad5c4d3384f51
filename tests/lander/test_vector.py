import gymnasium
import numpy as np
import pytest
from gymnasium.error import ClosedEnvironmentError
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode, SyncVectorEnv

import touchdown.lander
from touchdown.core.errors import UserError
from touchdown.lander._engine import simd
from touchdown.lander.single import LanderEnv
from touchdown.lander.vector import LanderVectorEnv, StepArrays

WINDY = {"continuous": True, "enable_wind": True}


def actions_of(rng: np.random.Generator, count: int, settings: dict) -> np.ndarray:
    if settings:
        return rng.uniform(-1.3, 1.3, (count, 2)).astype(np.float32)
    return rng.integers(0, 4, count)


@pytest.mark.parametrize("settings", [{}, WINDY], ids=["discrete", "continuous with wind"])
@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_many_landers_are_stock_landers_byte_for_byte(mode: AutoresetMode, settings: dict):
    count = 21  # not a multiple of any number of lanes
    stock = SyncVectorEnv(
        [lambda: gymnasium.make("LunarLander-v3", **settings)] * count, autoreset_mode=mode
    )
    ours = LanderVectorEnv(count, autoreset_mode=mode, **settings)
    assert ours.observation_space == stock.observation_space
    assert ours.action_space == stock.action_space
    assert ours.reset(seed=7)[0].tobytes() == stock.reset(seed=7)[0].tobytes()
    rng = np.random.default_rng(0)
    ends = 0
    for _ in range(150):
        actions = actions_of(rng, count, settings)
        theirs, mine = stock.step(actions), ours.step(actions)
        for a, b in zip(theirs[:4], mine[:4], strict=True):
            assert a.dtype == b.dtype
            assert a.tobytes() == b.tobytes()
        assert theirs[4].keys() == mine[4].keys()
        for i in np.flatnonzero(mine[4].get("_final_obs", [])):
            assert theirs[4]["final_obs"][i].tobytes() == mine[4]["final_obs"][i].tobytes()
        ended = mine[2] | mine[3]
        ends += int(ended.sum())
        if mode == AutoresetMode.DISABLED and ended.any():
            with pytest.raises(ValueError, match="must be reset"):
                ours.step(actions)
            break
    stock.close()
    assert ends > 0


def test_the_time_limit_truncates_as_in_stock():
    envs = [LanderVectorEnv(1, max_episode_steps=30), LanderVectorEnv(1)]
    for env in envs:
        env.reset(seed=3)
    ends = [[env.step(np.array([0]))[3][0] for _ in range(30)] for env in envs]
    assert ends == [[False] * 29 + [True], [False] * 30]


@pytest.mark.filterwarnings("ignore")  # the checker warns of stock's own behaviour too
@pytest.mark.parametrize("env_id", ["LunarLander-v3", "LunarLanderContinuous-v3"])
def test_gymnasiums_checker_finds_nothing(env_id: str):
    env = gymnasium.make(f"touchdown/{env_id}")
    check_env(env.unwrapped)
    env.close()


def test_no_time_limit_is_spelled_as_in_gymnasium():
    name, many = "touchdown/LunarLander-v3", "vector_entry_point"
    endless = gymnasium.make_vec(name, 2, vectorization_mode=many, max_episode_steps=-1)
    endless.reset(seed=0)
    endless.unwrapped._steps[:] = 10**6
    assert not endless.step(np.array([0, 0]))[3].any()
    one = LanderEnv(max_episode_steps=-1)
    one.reset(seed=0)
    one._steps = 10**6
    assert one.step(0)[3] is False


def test_gymnasium_makes_it_by_its_id_one_or_many():
    stock, ours = gymnasium.make("LunarLander-v3"), gymnasium.make("touchdown/LunarLander-v3")
    assert ours.spec is not None
    assert (ours.spec.max_episode_steps, ours.spec.reward_threshold) == (1_000, 200)
    assert stock.reset(seed=1)[0].tobytes() == ours.reset(seed=1)[0].tobytes()
    for action in (2, 0, 3, 1, np.int64(2)):
        theirs, mine = stock.step(action), ours.step(action)
        assert theirs[0].tobytes() == mine[0].tobytes()
        assert theirs[1:] == mine[1:]
    many = gymnasium.make_vec(
        "touchdown/LunarLander-v3", num_envs=3, vectorization_mode="vector_entry_point"
    )
    assert isinstance(many.unwrapped, LanderVectorEnv)
    assert many.reset(seed=1)[0][0].tobytes() == stock.reset(seed=1)[0].tobytes()


def test_a_snapshot_continues_mid_flight_with_its_generator_and_step_count():
    env = LanderVectorEnv(3, max_episode_steps=40)
    env.reset(seed=5)
    rng = np.random.default_rng(1)
    for _ in range(25):
        env.step(rng.integers(0, 4, 3))
    saved = [env.snapshot(i) for i in range(3)]
    plan = rng.integers(0, 4, (60, 3))
    first = [env.step(actions) for actions in plan]
    assert any(step[3].any() for step in first)
    for i, snapshot in enumerate(saved):
        env.restore(i, snapshot)
    for actions, before in zip(plan, first, strict=True):
        for a, b in zip(before[:4], env.step(actions)[:4], strict=True):
            assert a.tobytes() == b.tobytes()


def test_a_lander_does_not_depend_on_the_others_in_its_batch():
    many, few = LanderVectorEnv(50), LanderVectorEnv(2)
    many.reset(seed=0)
    few.reset(seed=[33, 8])
    rng = np.random.default_rng(2)
    for _ in range(120):
        actions = rng.integers(0, 4, 50)
        wide, narrow = many.step(actions), few.step(actions[[33, 8]])
        for a, b in zip(wide[:4], narrow[:4], strict=True):
            assert a[[33, 8]].tobytes() == b.tobytes()


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_given_arrays_are_written_in_place_and_returned(mode: AutoresetMode):
    given, fresh = LanderVectorEnv(4, autoreset_mode=mode), LanderVectorEnv(4, autoreset_mode=mode)
    given.reset(seed=1)
    fresh.reset(seed=1)
    out = StepArrays.empty(4)
    ends = 0
    for _ in range(140):
        theirs = fresh.step(np.full(4, 2))
        mine = given.step(np.full(4, 2), out=out)
        for array, a, b in zip(out, mine[:4], theirs[:4], strict=True):
            assert a is array
            assert a.tobytes() == b.tobytes()
        if (mine[2] | mine[3]).any():
            ends += 1
            if mode == AutoresetMode.DISABLED:
                break
    assert ends > 0


def test_a_reset_by_mask_leaves_the_others_in_flight_as_stock_does():
    stock = SyncVectorEnv([lambda: gymnasium.make("LunarLander-v3")] * 4, autoreset_mode="Disabled")
    ours = LanderVectorEnv(4, autoreset_mode="Disabled")
    for env in (stock, ours):
        env.reset(seed=3)
    rng = np.random.default_rng(0)
    resets = 0
    for _ in range(250):
        actions = rng.integers(0, 4, 4)
        theirs, mine = stock.step(actions), ours.step(actions)
        ended = mine[2] | mine[3]
        assert theirs[0].tobytes() == mine[0].tobytes()
        if ended.any():
            resets += 1
            again = [env.reset(options={"reset_mask": ended.copy()})[0] for env in (stock, ours)]
            assert again[0].tobytes() == again[1].tobytes()
    stock.close()
    assert resets > 3
    for mask in (np.ones(3, np.bool_), np.ones(4), np.zeros(4, np.bool_)):
        with pytest.raises(ValueError, match=r"reset_mask is .*: must be bool\(4,\)"):
            ours.reset(options={"reset_mask": mask})


def test_a_copy_continues_as_its_original_does():
    env = LanderVectorEnv(5, max_episode_steps=150)
    env.reset(seed=0)
    rng = np.random.default_rng(1)
    for _ in range(60):
        env.step(rng.integers(0, 4, 5))
    env.copy_state(2, [0, 4])
    for _ in range(200):
        o, *_ = env.step(np.full(5, rng.integers(0, 4)))
        assert o[2].tobytes() == o[0].tobytes() == o[4].tobytes() != o[1].tobytes()


@pytest.mark.parametrize("engine", ["exact", "gymnasium"])
def test_the_same_call_makes_either_engine(engine: str):
    env = touchdown.lander.make_vec(2, engine=engine, gravity=-5.0, autoreset_mode="SameStep")
    assert env.metadata["autoreset_mode"] == AutoresetMode.SAME_STEP
    one = touchdown.lander.make(engine=engine, gravity=-5.0)
    o, _ = env.reset(seed=7)
    assert o[0].tobytes() == one.reset(seed=7)[0].tobytes()
    assert env.step(np.array([2, 2]))[0][0].tobytes() == one.step(2)[0].tobytes()
    env.close()
    one.close()
    with pytest.raises(ValueError, match="num_envs = 0: must be at least 1"):
        touchdown.lander.make_vec(0, engine=engine)
    with pytest.raises(UserError, match="engine 'exakt': must be exact or gymnasium"):
        touchdown.lander.make_vec(2, engine="exakt")


def test_a_closed_environment_raises():
    many, one = LanderVectorEnv(1), LanderEnv()
    for env in (many, one):
        env.reset(seed=0)
        env.close()
        with pytest.raises(ClosedEnvironmentError, match="make a new one"):
            env.reset()
    with pytest.raises(ClosedEnvironmentError):
        many.step(np.array([0]))
    with pytest.raises(ClosedEnvironmentError):
        one.step(0)


def test_the_instruction_set_has_a_name():
    assert simd() in {"avx512", "avx2", "baseline"}


def test_actions_of_any_whole_type_and_layout_are_the_same_actions():
    actions = np.random.default_rng(0).integers(4, size=(30, 5))
    wide = np.repeat(actions, 2, axis=1)
    unaligned = np.frombuffer(b"x" + actions.tobytes(), np.uint8)[1:].view(np.int64)
    read_only = actions.copy()
    read_only.flags.writeable = False
    kinds = {
        "plain": actions,
        "int32": actions.astype(np.int32),
        "uint8": actions.astype(np.uint8),
        "strided": wide[:, ::2],
        "byte-swapped": actions.astype(actions.dtype.newbyteorder()),
        "unaligned": unaligned.reshape(actions.shape),
        "read-only": read_only,
    }
    seen = {}
    for name, of_kind in kinds.items():
        env = LanderVectorEnv(5)
        env.reset(seed=0)
        before = of_kind.copy()
        seen[name] = [env.step(row)[0].tobytes() for row in of_kind]
        assert (of_kind == before).all()
    assert all(of_kind == seen["plain"] for of_kind in seen.values())


def test_a_refused_action_changes_nothing():
    env, twin = LanderVectorEnv(2), LanderVectorEnv(2)
    for each in (env, twin):
        each.reset(seed=0)
    with pytest.raises(ValueError, match="must be a whole number from 0 to 3"):
        env.step(np.array([2, 4]))
    for index in range(2):
        assert env.snapshot(index) == twin.snapshot(index)


def test_invalid_arguments_are_refused_by_name():
    with pytest.raises(ValueError, match="num_envs = 0: must be at least 1"):
        LanderVectorEnv(0)
    with pytest.raises(ValueError, match="num_envs = 2147483648: must be at most 1000000"):
        LanderVectorEnv(2**31)
    with pytest.raises(ValueError, match=r"gravity = -12\.0"):
        LanderVectorEnv(1, gravity=-12.0)
    for kind in (LanderEnv, LanderVectorEnv):
        with pytest.raises(ValueError, match="render_mode 'human': must be rgb_array or None"):
            kind(render_mode="human")
    env = LanderVectorEnv(2)
    with pytest.raises(RuntimeError, match="reset environment 0"):
        env.step(np.array([0, 0]))
    with pytest.raises(ValueError, match=r"seed\[1\] = 2\.5: must be a whole number"):
        env.reset(seed=[1, 2.5])
    with pytest.raises(ValueError, match="seed has 3 entries, must have 2"):
        env.reset(seed=[1, 2, 3])
    env.reset(seed=0)
    with pytest.raises(ValueError, match=r"actions\[1\] = 4: must be a whole number from 0 to 3"):
        env.step(np.array([0, 4]))
    with pytest.raises(ValueError, match=r"actions are float64\(2,\), must be int64\(2,\)"):
        env.step(np.array([0.0, 1.0]))
    with pytest.raises(ValueError, match=r"actions are int64\(3,\)"):
        env.step(np.array([0, 1, 2]))
    for out, complaint in {
        "observations": (np.zeros((2, 8)), r"float64\(2, 8\), must be float32\(2, 8\)"),
        "truncated": (np.zeros(3, np.bool_), r"bool\(3,\), must be bool\(2,\)"),
        "rewards": (np.zeros(4)[::2], "must be contiguous and writable"),
    }.items():
        arrays = StepArrays.empty(2)._replace(**{out: complaint[0]})
        with pytest.raises(ValueError, match=rf"out\.{out} .*{complaint[1]}"):
            env.step(np.array([0, 0]), out=arrays)
    buffer = np.zeros(80, np.uint8)
    overlapping = {
        "terminated": ("truncated", buffer[:2].view(np.bool_), buffer[1:3].view(np.bool_)),
        "observations": (
            "rewards",
            buffer[:64].view(np.float32).reshape(2, 8),
            buffer[56:72].view(np.float64),
        ),
    }
    for one, (other, *arrays) in overlapping.items():
        shared = StepArrays.empty(2)._replace(**dict(zip((one, other), arrays, strict=True)))
        with pytest.raises(ValueError, match=rf"out\.{one} and out\.{other} must not share memory"):
            env.step(np.array([0, 0]), out=shared)
    good = env.snapshot(0)
    for foreign, complaint in {
        b"x" * 100: "not a snapshot",
        good[:8] + b"\x09" + good[9:]: "version 9: must be 2",
        good[:-1]: "damaged",
        good[:20]: "damaged",
    }.items():
        with pytest.raises(ValueError, match=complaint):
            env.restore(0, foreign)
    assert env.snapshot(0) == good
    with pytest.raises(ValueError, match="num_threads = 0: must be at least 1"):
        LanderVectorEnv(1, num_threads=0)
    with pytest.raises(ValueError, match="num_threads = 1025: must be at most 1024"):
        LanderVectorEnv(1, num_threads=1_025)
    for kind in (LanderEnv, LanderVectorEnv):
        for limit in (0, -2):
            with pytest.raises(
                ValueError, match=f"max_episode_steps = {limit}: must be at least 1"
            ):
                kind(max_episode_steps=limit)
    windy = LanderVectorEnv(1, **WINDY)
    windy.reset(seed=0)
    with pytest.raises(ValueError, match=r"actions\[0\] is not a number"):
        windy.step(np.array([[np.nan, 0.0]], np.float32))
