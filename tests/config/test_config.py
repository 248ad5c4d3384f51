import dataclasses
import math
import re
import tomllib
import typing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from touchdown.config.config import Config, from_toml
from touchdown.config.digest import digest_with_seed
from touchdown.config.presets import PRESETS
from touchdown.config.sections import (
    SECTIONS,
    ExplorationConfig,
    LearningConfig,
    NetworkConfig,
    ReplayConfig,
    RolloutConfig,
    TableConfig,
    TrainingConfig,
)
from touchdown.config.toml import (
    FORMAT_VERSION,
    from_values,
    read_toml,
    replace_fields,
    to_dict,
    to_toml,
)
from touchdown.core.errors import UserError


def write(folder: Path, text: str) -> Path:
    path = folder / "my.toml"
    path.write_text(text, "utf-8")
    return path


# --- TOML both ways ---

counts = st.integers(1, 10**9)
shares = st.floats(0, 1).map(abs)  # -0.0 equals 0.0 and prints another way
positive = st.floats(1e-300, 1e300)
words = st.text(st.characters(codec="utf-8", exclude_categories=["Cc"]), max_size=12)


@st.composite
def configs(draw: st.DrawFn) -> Config:
    capacity = draw(counts)
    epsilon_start = draw(shares)
    return Config(
        preset=draw(st.from_regex(r"[A-Za-z0-9][A-Za-z0-9._-]{0,20}", fullmatch=True)),
        seed=draw(st.integers(0, 2**32 - 1)),
        env_id=draw(words),
        network=NetworkConfig(
            hidden_sizes=tuple(draw(st.lists(st.integers(1, 100_000), max_size=4))),
            activation=draw(st.sampled_from(["relu", "tanh", "silu"])),
        ),
        replay=ReplayConfig(
            capacity=capacity,
            min_size=draw(st.integers(1, capacity)),
            resaves=draw(st.integers(0, 100)),
            resave_threshold=draw(st.floats(-1e300, 1e300)),
        ),
        exploration=ExplorationConfig(
            schedule=draw(st.sampled_from(["constant", "linear", "exponential"])),
            epsilon_start=epsilon_start,
            epsilon_end=draw(st.floats(0, epsilon_start)),
            epsilon_decay=draw(shares),
            epsilon_duration=draw(counts),
        ),
        learning=LearningConfig(
            gamma=draw(shares),
            learning_rate=draw(positive),
            learning_rate_end=draw(positive),
            optimizer=draw(st.sampled_from(["adam", "adamw", "rmsprop", "sgd"])),
            batch_size=draw(counts),
            loss=draw(st.sampled_from(["mse", "huber"])),
            reward_scale=draw(positive),
            max_grad_norm=draw(positive),
            update_period=draw(counts),
            target_period=draw(st.integers(0, 10**9)),
        ),
        training=TrainingConfig(
            episodes=draw(counts),
            max_env_steps=draw(st.integers(0, 10**9)),
            test_episodes=draw(st.integers(0, 10**6)),
            checkpoint_seconds=draw(positive),
        ),
    )


@given(config=configs())
def test_a_config_comes_back_from_its_toml_with_the_same_digest(
    config: Config, tmp_path_factory: pytest.TempPathFactory
):
    path = write(tmp_path_factory.mktemp("config"), to_toml(config))
    again = from_toml(path)
    assert again == config
    assert again.digest == config.digest


@pytest.mark.parametrize("name", PRESETS)
def test_a_preset_comes_back_from_its_toml_label_and_all(name: str, tmp_path: Path):
    again = from_toml(write(tmp_path, to_toml(PRESETS[name])))
    assert again == PRESETS[name]
    assert again.preset == name


def test_toml_spells_out_every_field_once():
    text = to_toml(Config())
    names = [item.name for section in SECTIONS.values() for item in dataclasses.fields(section)]
    for name in [*names, "format_version", "preset", "seed", "env_id"]:
        assert text.count(f"\n{name} = ") + text.startswith(f"{name} = ") == 1, name


def test_fields_that_a_file_leaves_out_keep_those_of_the_base(tmp_path: Path):
    base = PRESETS["paper-best"]
    file = write(tmp_path, "seed = 7\n[learning]\ngamma = 0.5\n")
    read = from_values(read_toml(file), base, file)
    learning = dataclasses.replace(base.learning, gamma=0.5)
    assert read == dataclasses.replace(base, seed=7, learning=learning)
    assert read.learning.target_period == 800  # the default is 0


def test_an_empty_file_is_the_default_config(tmp_path: Path):
    assert from_toml(write(tmp_path, "")) == Config()


def test_whole_numbers_in_float_fields_are_the_same_setting_as_floats(tmp_path: Path):
    text = "[learning]\ngamma = {}\nreward_scale = {}\n[training]\ncheckpoint_seconds = {}\n"
    whole = from_toml(write(tmp_path, text.format("1", "2", "3")))
    point = from_toml(write(tmp_path, text.format("1.0", "2.0", "3.0")))
    made = Config(
        learning=LearningConfig(gamma=1, reward_scale=2),
        training=TrainingConfig(checkpoint_seconds=3),
    )
    assert whole == point == made
    assert whole.digest == point.digest == made.digest
    assert type(made.learning.gamma) is float


# --- digest ---


def test_digest_ignores_the_label_of_the_preset():
    config = Config(preset="dqn", seed=3)
    assert dataclasses.replace(config, preset="mine").digest == config.digest


_OTHER = {"env_id": "CartPole-v1", "algorithm": "pqn", "options": {"alpha": 0.5}}


def other_value(name: str, kind: Any, value: Any) -> Any:
    """A value of the field's kind that is in range and is not the given one."""
    if name in _OTHER:
        return _OTHER[name]
    if typing.get_origin(kind) is typing.Literal:
        return next(choice for choice in typing.get_args(kind) if choice != value)
    if kind is bool:
        return not value
    if kind is int:
        return value + 1
    if kind is float:
        return value + 0.001
    return [value[0] + 1, *value[1:]] if value else [7]


def places() -> list[tuple[str | None, str]]:
    top = [(None, item.name) for item in dataclasses.fields(Config) if item.name not in SECTIONS]
    nested = [
        (name, item.name) for name, kind in SECTIONS.items() for item in dataclasses.fields(kind)
    ]
    return [place for place in top + nested if place != (None, "preset")]


@pytest.mark.parametrize(("section", "name"), places())
def test_digest_changes_with_every_field_but_the_label(section: str | None, name: str):
    # a middle ground, from which a step up is in range for every field
    learning = LearningConfig(target_period=9 if name == "double" else 0)
    if name == "quantiles":  # they go with no other loss
        learning = dataclasses.replace(learning, loss="huber")
    network = NetworkConfig(atoms=51 if name == "atoms" else 0)  # one atom would be none
    cut = TableConfig(bins=(3,), bins_low=(0,), bins_high=(5,))
    config = Config(
        exploration=ExplorationConfig(epsilon_start=0.5),
        learning=learning,
        network=network,
        algorithm={"table": "tabular", "rollout": "pqn", "options": "own:Agent"}.get(
            section or name, "dqn"
        ),
        table=cut if section == "table" else TableConfig(),
    )
    holder = getattr(config, section) if section else config
    kind = typing.get_type_hints(type(holder))[name]
    values = {name: other_value(name, kind, getattr(holder, name))}
    changed = replace_fields(config, {section: values} if section else values, "test")
    assert changed.digest != config.digest


@pytest.mark.parametrize(
    ("name", "backend", "digest"),
    [
        ("paper-best", "jax", "0eb735c1a51a"),
        ("swift", "fused", "e9348d809c61"),
        ("tabular-lander", "jax", "82cbfce239e8"),
        ("c51-dqn", "jax", "488247d9ea7f"),
    ],
)
def test_digests_are_those_under_which_runs_have_been_stored(name, backend, digest):
    config = replace_fields(PRESETS[name], {"learning": {"backend": backend}}, "test")
    assert config.digest == digest


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class LaterLearning(LearningConfig):
    """The section with a field that a later version adds."""

    clipped: bool = False


def test_a_field_that_is_added_later_changes_no_digest_until_it_is_set():
    assert Config(learning=LaterLearning(gamma=0.5)).digest == (
        Config(learning=LearningConfig(gamma=0.5)).digest
    )
    assert Config(learning=LaterLearning(clipped=True)).digest != Config().digest


def test_the_digest_with_another_seed_is_that_of_the_config_with_that_seed():
    for config in (Config(), Config(algorithm="tabular", seed=12), Config(seed=7, env_id="a:B")):
        for seed in (0, 1, 12, 4_294_967_295):
            whole = dataclasses.replace(config, seed=seed)
            assert digest_with_seed(config, seed) == whole.digest


def test_the_order_of_options_changes_no_digest():
    one, other = (
        Config(algorithm="own:Agent", options=dict(pairs))
        for pairs in ([("a", 1), ("b", 2)], [("b", 2), ("a", 1)])
    )
    assert one.digest == other.digest
    assert one.digest == dataclasses.replace(one, options={"a": 1.0, "b": 2}).digest  # equal to it
    assert one.digest != dataclasses.replace(one, options={"a": 1}).digest


def test_the_fused_backend_refuses_a_field_that_it_does_not_know():
    Config(learning=LaterLearning(backend="fused"))
    with pytest.raises(ValueError, match="clipped = True: must be False with backend = 'fused'"):
        Config(learning=LaterLearning(backend="fused", clipped=True))


def test_options_are_for_an_agent_of_ones_own():
    with pytest.raises(ValueError, match=r"options = {'a': 1}: must be empty"):
        Config(options={"a": 1})
    config = Config(algorithm="own:Agent", options={"a": np.float32(0.5), "b": True, "c": "x"})
    assert config.options == {"a": 0.5, "b": True, "c": "x"}
    assert config == from_values(tomllib.loads(to_toml(config)), Config(), Path("my.toml"))
    with pytest.raises(ValueError, match="options"):
        Config(algorithm="own:Agent", options={"a": math.nan})
    with pytest.raises(ValueError, match="options"):
        Config(algorithm="own:Agent", options={"a": [1]})


def test_an_agent_of_ones_own_may_use_every_section():
    Config(
        algorithm="own:Agent",
        rollout=RolloutConfig(epochs=9),
        table=TableConfig(initial_value=1),
        learning=LearningConfig(target="expected-sarsa"),
    )


def test_digest_is_12_hex_digits():
    assert len(Config().digest) == 12
    int(Config().digest, 16)


# --- refusals ---

REFUSED_BY_CONSTRUCTOR: list[tuple[type[Any], dict[str, Any]]] = [
    (NetworkConfig, {"hidden_sizes": (100, 0)}),
    (NetworkConfig, {"hidden_sizes": (-5,)}),
    (NetworkConfig, {"atoms": 1}),
    (NetworkConfig, {"atoms": -51}),
    (NetworkConfig, {"atoms": 100_001}),
    (NetworkConfig, {"v_min": 10.0}),
    (NetworkConfig, {"v_min": -math.inf}),
    (NetworkConfig, {"v_max": -10.0}),
    (NetworkConfig, {"noisy_sigma": 0.0}),
    (NetworkConfig, {"noisy_sigma": -0.5}),
    (ReplayConfig, {"capacity": 0}),
    (ReplayConfig, {"capacity": -3}),
    (ReplayConfig, {"min_size": 0}),
    (ReplayConfig, {"min_size": 100_001}),
    (ReplayConfig, {"resaves": -1}),
    (ReplayConfig, {"resave_threshold": math.nan}),
    (ReplayConfig, {"resave_threshold": -math.inf}),
    (ExplorationConfig, {"epsilon_start": 1.5}),
    (ExplorationConfig, {"epsilon_start": 0.005}),
    (ExplorationConfig, {"epsilon_end": -0.1}),
    (ExplorationConfig, {"epsilon_decay": 1.001}),
    (ExplorationConfig, {"epsilon_decay": math.nan}),
    (ExplorationConfig, {"epsilon_duration": 0}),
    (LearningConfig, {"gamma": -0.01}),
    (LearningConfig, {"gamma": 1.01}),
    (LearningConfig, {"gamma": math.nan}),
    (LearningConfig, {"learning_rate": 0.0}),
    (LearningConfig, {"learning_rate": math.inf}),
    (LearningConfig, {"learning_rate_end": -1e-9}),
    (LearningConfig, {"learning_rate_duration": -1}),
    (LearningConfig, {"batch_size": 0}),
    (LearningConfig, {"batch_size": -64}),
    (LearningConfig, {"reward_scale": 0.0}),
    (LearningConfig, {"max_grad_norm": -1.0}),
    (LearningConfig, {"update_period": 0}),
    (LearningConfig, {"target_period": -1}),
    (TrainingConfig, {"episodes": 0}),
    (TrainingConfig, {"max_env_steps": -1}),
    (TrainingConfig, {"validation_period": 0}),
    (TrainingConfig, {"validation_episodes": 0}),
    (TrainingConfig, {"candidate_checkpoints": 0}),
    (TrainingConfig, {"final_validation_episodes": -2}),
    (TrainingConfig, {"test_episodes": -1}),
    (TrainingConfig, {"checkpoint_seconds": -0.5}),
    (TrainingConfig, {"checkpoint_seconds": math.inf}),
    (TrainingConfig, {"metrics_period": 0}),
    (TrainingConfig, {"num_envs": 0}),
    (TrainingConfig, {"num_envs": 10_001}),
    (LearningConfig, {"gradient_steps": 0}),
    (TableConfig, {"bins": (4, 0)}),
    (TableConfig, {"bins_low": (1.0,)}),
    (TableConfig, {"bins_high": (1.0, 2.0)}),
    (TableConfig, {"bins": (10_000, 10_001)}),
    (TableConfig, {"initial_value": math.nan}),
    (RolloutConfig, {"rollout_steps": 0}),
    (RolloutConfig, {"epochs": -1}),
    (RolloutConfig, {"minibatches": 0}),
    (RolloutConfig, {"trace_decay": 1.01}),
    (Config, {"seed": -1}),
    (Config, {"seed": 2**32}),
]


def assert_names(message: str, values: dict[str, Any]) -> None:
    (name, value), *_ = values.items()
    shown = list(value) if isinstance(value, tuple) else value
    assert "\n" not in message
    assert name in message
    assert str(shown).strip("[]") in message


def toml_of(value: Any) -> str:
    return str(list(value)) if isinstance(value, tuple) else str(value)


@pytest.mark.parametrize(("section", "values"), REFUSED_BY_CONSTRUCTOR)
def test_constructor_refuses_nonsense_naming_field_and_value(
    section: type[Any], values: dict[str, Any]
):
    with pytest.raises(ValueError, match=r"must be") as refusal:
        section(**values)
    assert_names(str(refusal.value), values)


@pytest.mark.parametrize(("section", "values"), REFUSED_BY_CONSTRUCTOR)
def test_a_file_with_nonsense_is_refused_naming_file_field_and_value(
    section: type[Any], values: dict[str, Any], tmp_path: Path
):
    headers = {kind: f"[{name}]\n" for name, kind in SECTIONS.items()}
    lines = "".join(f"{name} = {toml_of(value)}\n" for name, value in values.items())
    path = write(tmp_path, headers.get(section, "") + lines)
    with pytest.raises(UserError) as refusal:
        from_toml(path)
    assert_names(str(refusal.value), values)
    assert str(path) in str(refusal.value)


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ('seed = "seven"', ["seed", "'seven'", "a whole number"]),
        ("seed = 1.0", ["seed", "1.0", "a whole number"]),
        ("seed = true", ["seed", "True", "a whole number"]),
        ("env_id = 3", ["env_id", "3", "a string"]),
        ('[learning]\ngamma = "high"', ["[learning]", "gamma", "'high'", "a number"]),
        ("[learning]\ngamma = true", ["[learning]", "gamma", "True", "a number"]),
        ('[learning]\noptimizer = "lion"', ["optimizer", "'lion'", "adam, adamw, rmsprop, sgd"]),
        ("[learning]\nloss = 1", ["loss", "1", "mse, huber"]),
        ('[network]\nactivation = "gelu"', ["activation", "'gelu'", "relu, tanh, silu"]),
        ('[exploration]\nschedule = "cosine"', ["schedule", "'cosine'", "constant, linear"]),
        ("[network]\nhidden_sizes = 100", ["hidden_sizes", "100", "a list"]),
        ("[network]\nhidden_sizes = [100, 1.5]", ["hidden_sizes", "1.5", "a whole number"]),
        ("network = 3", ["network", "3", "table [network]"]),
        ("sede = 3", ["unknown field 'sede'", "seed"]),
        ("[learning]\ngama = 0.9", ["[learning]", "unknown field 'gama'", "gamma"]),
        ("[lerning]\ngamma = 0.9", ["unknown field 'lerning'", "learning"]),
        ("[replay]\ncapacity = 10\nmin_size = 11", ["min_size = 11", "capacity = 10"]),
    ],
)
def test_a_file_with_a_wrong_field_or_type_is_refused_on_one_line(
    text: str, named: list[str], tmp_path: Path
):
    path = write(tmp_path, text)
    with pytest.raises(UserError) as refusal:
        from_toml(path)
    message = str(refusal.value)
    assert "\n" not in message
    for part in [str(path), *named]:
        assert part in message


def test_the_floor_of_epsilon_is_free_where_the_schedule_is_constant():
    config = ExplorationConfig(schedule="constant", epsilon_start=0.0)
    assert config.epsilon_end == 0.01  # above epsilon_start, and not used


def test_another_format_version_is_refused_by_its_number(tmp_path: Path):
    path = write(tmp_path, f"format_version = {FORMAT_VERSION + 1}\nseed = 1\n")
    with pytest.raises(UserError, match=rf"format_version = {FORMAT_VERSION + 1}") as refusal:
        from_toml(path)
    assert str(path) in str(refusal.value)


def test_this_format_version_is_read_and_is_no_field_of_the_config(tmp_path: Path):
    assert from_toml(write(tmp_path, f"format_version = {FORMAT_VERSION}\nseed = 4")).seed == 4
    assert "format_version" not in to_dict(Config())


def test_what_is_not_toml_is_refused_on_one_line(tmp_path: Path):
    path = write(tmp_path, "seed = \n")
    with pytest.raises(UserError, match="not TOML") as refusal:
        read_toml(path)
    assert str(path) in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_a_file_that_is_not_there_or_not_text_cannot_be_read(tmp_path: Path):
    with pytest.raises(UserError, match=r"none\.toml: cannot be read"):
        from_toml(tmp_path / "none.toml")
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(UserError, match=r"binary\.toml: cannot be read"):
        from_toml(tmp_path / "binary.toml")


def test_a_config_is_frozen():
    with pytest.raises(dataclasses.FrozenInstanceError):
        Config().seed = 1  # pyright: ignore[reportAttributeAccessIssue]
    with pytest.raises(dataclasses.FrozenInstanceError):
        Config().learning.gamma = 0.5  # pyright: ignore[reportAttributeAccessIssue]


@pytest.mark.parametrize("make", [np.float64, np.float32, int, float])
def test_numpy_numbers_and_lists_are_the_same_settings_as_pythons(make, tmp_path):
    plain = Config(
        seed=1, network=NetworkConfig(hidden_sizes=(8, 4)), learning=LearningConfig(gamma=1.0)
    )
    numpy = Config(
        seed=np.int64(1),
        network=NetworkConfig(hidden_sizes=[np.int32(8), 4]),
        learning=LearningConfig(gamma=make(1)),
    )
    assert numpy == plain
    assert numpy.digest == plain.digest
    (tmp_path / "c.toml").write_text(to_toml(numpy))
    assert from_toml(tmp_path / "c.toml") == plain


def test_a_zero_has_no_sign():
    plain = Config(learning=LearningConfig(reward_scale=2, learning_rate_end=0.0))
    signed = Config(learning=LearningConfig(reward_scale=2, learning_rate_end=-0.0))
    assert str(signed.learning.learning_rate_end) == "0.0"
    assert signed.digest == plain.digest


def test_constructors_refuse_other_types_and_choices():
    for make, said in [
        (lambda: LearningConfig(optimizer="nope"), "optimizer = 'nope': must be one of adam"),
        (lambda: NetworkConfig(activation="gelu"), "activation = 'gelu': must be one of relu"),
        (lambda: ReplayConfig(capacity=1e5), "capacity = 100000.0: must be a whole number"),
        (lambda: Config(seed="a"), "seed = 'a': must be a whole number"),
        (lambda: LearningConfig(gamma=True), "gamma = True: must be a number"),
        (lambda: Config(learning={}), "learning = {}: must be a LearningConfig"),
    ]:
        with pytest.raises(ValueError, match=re.escape(said)):
            make()


@pytest.mark.parametrize("text", ["a\rb", "a\x01b", 'quo"te', "back\\slash", "U+2028 \u2028", "🚀"])
def test_every_string_comes_back_from_toml(text, tmp_path):
    (tmp_path / "c.toml").write_text(to_toml(Config(env_id=text)), "utf-8", newline="\n")
    assert from_toml(tmp_path / "c.toml").env_id == text


@pytest.mark.parametrize(
    "text",
    ["[learning]\nlearning_rate = 1" + "0" * 400, "seed = " + "9" * 5000, "seed = " + "[" * 10**5],
)
def test_numbers_and_brackets_beyond_reason_are_refused_in_one_line(text, tmp_path):
    (tmp_path / "c.toml").write_text(text)
    with pytest.raises(UserError) as said:
        from_toml(tmp_path / "c.toml")
    assert "\n" not in str(said.value)


@pytest.mark.parametrize(
    ("values", "complaint"),
    [
        ({"polyak": 0.1, "target_period": 800}, r"polyak = 0\.1: must be 0 with target_period"),
        ({"double": 1}, "double = 1: must be true or false"),
        ({"n_step": 0}, "n_step = 0: must be 1 to"),
        ({"polyak": 1.5}, r"polyak = 1\.5: must be from 0"),
        ({"averaging": 1.5}, r"averaging = 1\.5: must be from 0 \(none\) to 1"),
    ],
)
def test_parts_that_do_not_go_together_are_refused_with_the_reason(values, complaint):
    with pytest.raises(ValueError, match=complaint):
        LearningConfig(**values)


def test_quantiles_and_a_squared_error_do_not_go_together():
    with pytest.raises(ValueError, match="loss = 'mse': must be huber with quantiles = 8"):
        Config(network=NetworkConfig(quantiles=8))


def test_quantiles_and_atoms_do_not_go_together():
    with pytest.raises(ValueError, match="atoms = 51: must be 0 with quantiles = 8; use one"):
        NetworkConfig(quantiles=8, atoms=51)


@pytest.mark.parametrize("loss", ["mse", "huber"])
def test_atoms_go_with_either_loss(loss):
    config = Config(network=NetworkConfig(atoms=51), learning=LearningConfig(loss=loss))
    assert config.learning.loss == loss


@pytest.mark.parametrize(
    ("values", "complaint"),
    [
        (
            {"bins": (2, 2), "bins_low": (0, 1), "bins_high": (1, 1)},
            "bins_low = (0.0, 1.0): must be below bins_high = (1.0, 1.0)",
        ),
        ({"bins": (2, 2), "bins_low": (0,)}, "bins_low = (0.0,): must be () or as long as bins"),
        ({"bins": (2, 2), "bins_high": (1, 1, 1)}, "bins_high = (1.0, 1.0, 1.0): must be () or"),
    ],
)
def test_bounds_of_a_table_that_do_not_go_together_are_refused(values, complaint):
    with pytest.raises(ValueError, match=re.escape(complaint)):
        TableConfig(**values)


def test_bounds_of_a_table_may_be_left_to_the_environment():
    assert TableConfig(bins=(2, 2)).bins_low == ()
    assert TableConfig(bins=(2, 2), bins_low=(0, 0)).bins_high == ()


# --- what an algorithm makes no use of ---


@pytest.mark.parametrize(
    ("values", "complaint"),
    [
        ({"rollout": RolloutConfig(epochs=3)}, "epochs = 3: must stay 2 with algorithm = 'dqn'"),
        (
            {"table": TableConfig(initial_value=1)},
            "initial_value = 1.0: must stay 0.0 with algorithm = 'dqn'",
        ),
        (
            {"algorithm": "pqn", "replay": ReplayConfig(resaves=1)},
            "resaves = 1: must stay 0 with algorithm = 'pqn'",
        ),
        (
            {"algorithm": "pqn", "learning": LearningConfig(target_period=9)},
            "target_period = 9: must stay 0 with algorithm = 'pqn'",
        ),
        (
            {"algorithm": "pqn", "network": NetworkConfig(noisy=True)},
            "noisy = True: must stay False with algorithm = 'pqn'",
        ),
        (
            {"algorithm": "tabular", "network": NetworkConfig(dueling=True)},
            "dueling = True: must stay False with algorithm = 'tabular'",
        ),
        (
            {"algorithm": "tabular", "learning": LearningConfig(n_step=3)},
            "n_step = 3: must stay 1 with algorithm = 'tabular'",
        ),
        (
            {"algorithm": "value-iteration", "learning": LearningConfig(learning_rate=0.5)},
            "learning_rate = 0.5: must stay 0.0005 with algorithm = 'value-iteration'",
        ),
        (
            {"algorithm": "value-iteration", "table": TableConfig(initial_value=1)},
            "initial_value = 1.0: must stay 0.0 with algorithm = 'value-iteration'",
        ),
        (
            {"algorithm": "tabular", "learning": LearningConfig(learning_rate=1.5)},
            "learning_rate = 1.5: must be at most 1 with algorithm = 'tabular'",
        ),
        (
            {
                "algorithm": "tabular",
                "learning": LearningConfig(learning_rate_end=2, learning_rate_duration=9),
            },
            "learning_rate = 2.0: must be at most 1 with algorithm = 'tabular'",
        ),
        ({"algorithm": "sarsa"}, "algorithm = 'sarsa': must be one of dqn, pqn, tabular, value"),
        (
            {"algorithm": "pqn", "rollout": RolloutConfig(rollout_steps=3, minibatches=4)},
            "minibatches = 4: must be at most the number of steps in a rollout, num_envs",
        ),
        (
            {"learning": LearningConfig(target="expected-sarsa")},
            "target = 'expected-sarsa': must be q-learning or sarsa with algorithm = 'dqn'",
        ),
    ],
)
def test_a_field_that_an_algorithm_makes_no_use_of_is_refused(values, complaint):
    with pytest.raises(ValueError, match=re.escape(complaint)):
        Config(**values)


def test_a_double_target_needs_a_target_network_and_the_greedy_action():
    with pytest.raises(ValueError, match="double = True: must have a target network"):
        Config(learning=LearningConfig(double=True))
    with pytest.raises(ValueError, match="double = True: must be False with target = 'sarsa'"):
        Config(learning=LearningConfig(double=True, target_period=9, target="sarsa"))


def test_a_refusal_never_asks_for_a_setting_that_is_refused_too():
    with pytest.raises(ValueError, match="double = True: must stay False with algorithm = 'pqn'"):
        Config(algorithm="pqn", learning=LearningConfig(double=True))
    fused = LearningConfig(backend="fused", loss="huber")
    with pytest.raises(ValueError, match="quantiles = 8: must stay 0 with algorithm = 'pqn'"):
        Config(algorithm="pqn", learning=fused, network=NetworkConfig(quantiles=8))


def test_what_an_algorithm_uses_is_taken():
    sarsa = LearningConfig(target="sarsa", learning_rate=0.5)
    Config(algorithm="tabular", learning=sarsa, table=TableConfig(bins=(3,), initial_value=2))
    Config(algorithm="tabular", learning=LearningConfig(target="expected-sarsa", learning_rate=1))
    Config(learning=sarsa)
    Config(
        algorithm="pqn", rollout=RolloutConfig(trace_decay=1), training=TrainingConfig(num_envs=4)
    )
    Config(algorithm="value-iteration", learning=LearningConfig(gamma=0.5, update_period=3))
