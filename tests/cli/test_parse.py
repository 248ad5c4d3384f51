import pytest

from command_line import complaint
from touchdown.cli import app, flags, parse
from touchdown.cli import presets as cli_presets
from touchdown.cli.train import Train
from touchdown.config import presets
from touchdown.config.sections import ALGORITHMS, NetworkConfig
from touchdown.config.toml import to_toml
from touchdown.core.errors import UserError


def shown_help(*words, capsys) -> str:
    with pytest.raises(SystemExit) as stop:
        app.main([*words, "--help"])
    assert stop.value.code == 0
    return capsys.readouterr().out


COMMANDS = [(verb,) for verb in parse.VERBS] + [
    *(("tune", word) for word in ("pid", "agent")),
    *(("study", word) for word in ("run", "status", "report", "list", "check")),
    *(("train", preset) for preset in ("pilot", "swift", "tabular-q", "value-iteration")),
]


@pytest.mark.parametrize("columns", [80, 120])
def test_no_line_of_any_help_is_wider_than_the_terminal(columns, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", str(columns))
    for words in [(), *COMMANDS]:
        text = shown_help(*words, capsys=capsys)
        assert text.startswith(f"usage: touchdown {' '.join(words)}".strip())
        assert max(map(len, text.splitlines())) <= columns, words
        assert "None" not in text, words


@pytest.mark.parametrize("words", [[], ["study"], ["tune"], ["help"], ["-h"]])
def test_a_word_that_needs_another_shows_its_help(words, capsys):
    with pytest.raises(SystemExit) as stop:
        app.main(words)
    assert stop.value.code == 0
    assert capsys.readouterr().out.startswith("usage: touchdown")


def test_help_before_a_verb_is_the_help_of_the_verb(capsys):
    with pytest.raises(SystemExit):
        app.main(["help", "tune", "pid"])
    assert capsys.readouterr().out.startswith("usage: touchdown tune pid [flags]")


def test_the_help_of_train_is_short_and_names_the_way_to_the_rest(capsys):
    text = shown_help("train", capsys=capsys)
    assert len(text.splitlines()) < 70
    assert "`touchdown presets` lists the presets" in text
    assert "--learning-rate FLOAT" in text
    assert "--noisy" not in text


def test_the_help_of_a_preset_shows_its_own_defaults(capsys):
    text = shown_help("train", "paper-best", capsys=capsys)
    assert "--resaves INT" in text
    assert "default: 10)" in text


@pytest.mark.parametrize(
    ("preset", "absent"),
    [
        ("pilot", ["--rollout-steps", "--bins"]),
        ("swift", ["--double", "--capacity", "--bins", "--optimizer", "--activation"]),
        ("tabular-q", ["--hidden-sizes", "--batch-size", "--trace-decay"]),
    ],
)
def test_the_help_of_a_preset_omits_the_settings_that_it_refuses(preset, absent, capsys):
    text = shown_help("train", preset, capsys=capsys)
    assert "--gamma" in text
    for flag in absent:
        assert flag not in text


def test_a_verb_that_flies_takes_a_policy(capsys):
    for verb in ("evaluate", "fly"):
        assert " POLICY" in shown_help(verb, capsys=capsys).splitlines()[0]


def test_lists_and_whole_numbers_are_read_in_every_common_form():
    for sizes in (["64", "32"], ["64,32"], ["64.0", "32"], ["[64,", "32]"], ["(64, 32)"]):
        verb = parse.parse(["train", "--hidden-sizes", *sizes])
        assert isinstance(verb, Train)
        assert verb.network.hidden_sizes == (64, 32)
    for text in ("1e5", "100_000", "100000.0", "100000"):
        verb = parse.parse(["train", f"--capacity={text}"])
        assert isinstance(verb, Train)
        assert verb.replay.capacity == 100_000


def test_flags_override_the_file_and_the_file_overrides_the_preset(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text("seed = 3\n[learning]\ngamma = 0.9\nbatch_size = 16\n")
    verb = parse.parse(["train", "paper-best", f"--config={file}", "--batch-size", "32"])
    assert isinstance(verb, Train)
    config = verb.settings()
    assert (config.seed, config.learning.gamma, config.learning.batch_size) == (3, 0.9, 32)
    assert config.replay == presets.preset("paper-best").replay


def test_settings_start_from_the_preset_that_a_file_names(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text('preset = "dqn"\n')
    verb = parse.parse(["train", f"--config={file}"])
    assert isinstance(verb, Train)
    assert verb.settings() == presets.preset("dqn")


def test_a_preset_that_is_not_a_plain_name_cannot_lead_out_of_the_runs_folder(tmp_path, capsys):
    file = tmp_path / "mine.toml"
    file.write_text('preset = "../escaped"\n')
    said = complaint("train", f"--config={file}", capsys=capsys)
    assert "preset = '../escaped': must be letters, digits" in said


def test_a_config_written_as_toml_is_read_back_as_the_same_config(tmp_path):
    config = presets.preset("paper-best")
    file = tmp_path / "config.toml"
    file.write_text(to_toml(config))
    verb = parse.parse(["train", "--config", str(file)])
    assert isinstance(verb, Train)
    assert verb.settings() == config


def test_an_unknown_verb_is_refused_before_anything_is_loaded():
    with pytest.raises(UserError, match="command 'land'"):
        parse.parse(["land"])


def test_help_without_the_sources_has_the_flags_and_no_texts(monkeypatch):
    def missing(_kind: type) -> str:
        raise OSError("could not get source code")

    monkeypatch.setattr(flags.inspect, "getsource", missing)
    found = list(flags._each_flag(NetworkConfig, "network"))
    assert "--hidden-sizes" in [flag.word for flag in found]
    assert not any(flag.text for flag in found)


def test_every_algorithm_has_a_title_among_the_presets():
    assert tuple(cli_presets._ALGORITHMS) == ALGORITHMS
