import pytest

from command_line import complaint
from touchdown.cli import app, parse
from touchdown.cli.train import Train
from touchdown.config import presets
from touchdown.config.toml import to_toml
from touchdown.core.errors import UserError


def test_the_help_of_every_verb_names_units_and_defaults(capsys):
    for verb in parse.VERBS:
        with pytest.raises(SystemExit) as stop:
            app.main([verb, "--help"])
        assert stop.value.code == 0
        assert f"usage: touchdown {verb}" in capsys.readouterr().out
    with pytest.raises(SystemExit):
        app.main(["train", "paper-best", "--help"])
    shown = capsys.readouterr().out
    assert "--resaves INT" in shown
    assert "default: 10)" in shown
    for name in presets.PRESETS:
        assert name in shown


@pytest.mark.parametrize("verb", ["evaluate", "fly"])
def test_verbs_that_fly_take_a_policy(verb, capsys):
    with pytest.raises(SystemExit):
        parse.parse([verb, "--help"])
    assert " POLICY" in capsys.readouterr().out.splitlines()[0]


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
    with pytest.raises(UserError, match="verb 'land'"):
        parse.parse(["land"])
