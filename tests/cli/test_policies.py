import json
import re

from command_line import complaint
from touchdown.cli import app
from touchdown.envs import custom
from touchdown.testing import Chain


def test_evaluate_flies_from_the_starts_asked_for(finished, capsys):
    where = f"--runs-dir={finished}"
    app.main(["evaluate", "cart", "--episodes=3", "--json", where])
    ours = json.loads(capsys.readouterr().out)
    stored = json.loads((finished / "cart" / "evaluation.json").read_text())["pilots"][0]
    assert ours["episodes"] == stored["episodes"]  # the run's own test, flown again
    app.main(["evaluate", "cart", "--episodes=2", "--seed=7", "--json", where])
    assert [e["seed"] for e in json.loads(capsys.readouterr().out)["episodes"]] == [7, 8]
    weights = finished / "cart" / "checkpoints" / "best.safetensors"
    app.main(["evaluate", str(weights), "--episodes=3", "--json"])
    assert json.loads(capsys.readouterr().out)["episodes"] == stored["episodes"]


def test_an_exported_run_flies_as_the_run_does(finished, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    app.main(["export", "cart", f"--runs-dir={finished}"])
    said = capsys.readouterr().out.splitlines()
    assert re.match(r"[\d,]+ of 10,000 actions agree with touchdown's", said[0])
    names = ["cart.onnx", "fly_onnx.py", "flight.gif", "README.md"]
    assert said[1:] == [f"  cart-onnx/{name}" for name in names]
    app.main(["evaluate", "cart-onnx/cart.onnx", "--episodes=3", "--json"])
    stored = json.loads((finished / "cart" / "evaluation.json").read_text())["pilots"][0]
    assert json.loads(capsys.readouterr().out)["episodes"] == stored["episodes"]
    again = complaint("export", "cart", f"--runs-dir={finished}", capsys=capsys)
    assert again == ("out 'cart-onnx': exists already; choose another, or replace it with --force")


def test_an_environment_without_pictures_is_flown_without_a_film(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    name = custom.name_of(Chain)
    app.main(["fly", "random", "--seed=4", f"--env-id={name}"])
    said = capsys.readouterr().out.splitlines()
    assert said[0].startswith(f"no film: environment {name}: draws no pictures")
    assert said[1].startswith("random from start 4: ")
    assert list(tmp_path.iterdir()) == []
    refused = complaint("fly", "random", f"--env-id={name}", "--out=x.gif", capsys=capsys)
    assert refused == said[0].removeprefix("no film: ")
