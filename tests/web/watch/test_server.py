"""The server as a page, and as those who must not, ask it."""

import shutil
import socket
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing
from http.client import HTTPConnection

import pytest

from touchdown.core.errors import UserError
from touchdown.runs import folder as folders
from touchdown.web.watch import columns, records
from touchdown.web.watch.run_index import RunIndex, key_of
from touchdown.web.watch.serving import Server
from watched_runs import Client, append, episode, new_run, recorded_run


@pytest.fixture
def client(unchanged):
    return unchanged[0]


@pytest.fixture
def key(unchanged):
    return unchanged[1]


@pytest.fixture
def changing(run, serve):
    """A server of a run that the test changes."""
    return serve(RunIndex(run.path.parent))


@pytest.mark.parametrize("token", ["", "wrong", "wrong" * 20, "%00", "ü".encode().hex()])
@pytest.mark.parametrize("path", ["", "runs", "events", "static/common/data.js", "../runs"])
def test_nobody_without_the_token_gets_anything(client, token, path):
    answer = client.ask(path, token=token)
    assert (answer.status, answer.body) == (403, b"forbidden\n")


def test_the_token_is_never_in_an_answer_to_one_who_lacks_it(client):
    answer = client.ask("", token=client.server.token[:-1])
    assert answer.status == 403
    assert client.server.token not in str(answer.headers)


@pytest.mark.parametrize(
    "headers", [{"Host": "example.com"}, {"Origin": "http://example.com"}, {"Origin": "null"}]
)
def test_pages_of_other_origins_are_refused_even_with_the_token(client, headers):
    assert client.ask("runs", **headers).status == 403


def test_the_server_listens_on_this_machine_alone_and_only_answers_get(client):
    address = client.server._socket.getsockname()
    assert address[0] == "127.0.0.1"
    assert [client.ask("runs", method).status for method in ("POST", "PUT", "DELETE")] == [405] * 3


@pytest.mark.parametrize(
    "path", ["", "runs", "static/common/data.js", "nothing", "run/x/policy/best"]
)
def test_no_answer_is_stored_or_framed_or_read_by_other_origins(client, path):
    headers = client.ask(path).headers
    assert headers["Cache-Control"] == "no-store"
    assert headers["Cross-Origin-Resource-Policy"] == "same-origin"
    assert headers["X-Frame-Options"] == "DENY"
    assert headers["X-Content-Type-Options"] == "nosniff"
    assert headers["Referrer-Policy"] == "no-referrer"
    assert "server" not in headers


def test_the_page_and_its_modules_are_served(client, key):
    page = client.ask(f"?run={key}")
    text = page.body.decode()
    assert page.headers["Content-Security-Policy"].startswith("default-src 'none'")
    assert "<title>watched</title>" in text
    assert client.server.token not in text
    for name in ("watch/watch.js", "engine/engine.js", "plotly.min.js"):
        answer = client.ask(f"static/{name}")
        assert answer.status == 200
        assert answer.headers["Content-Type"].startswith("text/javascript")


def test_the_list_names_each_run(client, key):
    (found,) = client.json("runs")
    assert (found["key"], found["label"], found["status"]) == (key, "watched", "stopped")


@pytest.mark.parametrize(
    "path",
    [
        "static/../../../../etc/passwd",
        "static/..%2f..%2fpage.py",
        "static/page.css",
        "static/%2fetc%2fpasswd",
        "run/{key}/policy/..%2f..%2fconfig.toml",
        "run/{key}/policy/%2fetc%2fpasswd",
        "run/{key}/policy/..",
        "run/{key}/policy/-1",
        "run/{key}/policy/1",
        "run/{key}/policy/best",
        "run/{key}/episode/0",
        "run/{key}/episode/" + 5000 * "9",
        "run/{key}/episode/1/",
        "runs/",
        "run/{key}/episode/..%2f1",
        "run/{key}/config.toml",
        "run/..%2f..%2fetc/policy/0",
        "run/watched/policy/0",
        "watched/config.toml",
        "..%2fwatched%2fconfig.toml",
    ],
)
def test_no_other_file_is_ever_served(client, key, path):
    answer = client.ask(path.format(key=key))
    assert answer.status == 404
    assert b"root:" not in answer.body


def test_the_token_without_a_slash_leads_to_the_same_page(client, key):
    connection = HTTPConnection("127.0.0.1", client.server.port, timeout=10)
    with closing(connection):
        connection.request("GET", f"/{client.server.token}?run={key}")
        answer = connection.getresponse()
        assert answer.status == 307
        assert answer.headers["Location"] == f"/{client.server.token}/?run={key}"


def test_an_unknown_run_has_a_title(client):
    assert "<title>Unknown run</title>" in client.ask(f"?run={'0' * 16}").body.decode()


def test_policies_and_episodes_are_served(client, key):
    assert client.ask(f"run/{key}/policy/0").body == b"weights 0"
    assert client.ask(f"run/{key}/policy/300").body == b"weights 300"
    assert client.json(f"run/{key}/episode/2")["start"] == 77
    answer = client.ask(f"run/{key}/episode/1")
    assert (answer.status, answer.body) == (404, b"episode 1: was not recorded")


def test_links_out_of_a_run_are_not_followed(changing, run, tmp_path):
    secret = tmp_path / "secret"
    secret.mkdir()
    (secret / "00000000.safetensors").write_bytes(b"secret")
    (secret / "best.safetensors").write_bytes(b"secret")
    (secret / "flights.jsonl").write_bytes(b"secret")
    run.best.symlink_to(secret / "best.safetensors")
    shutil.rmtree(run.over_training)
    run.over_training.symlink_to(secret)
    run.training_flights.unlink()
    run.training_flights.symlink_to(secret / "flights.jsonl")
    for path in ("policy/best", "policy/0", "episode/2"):
        answer = changing.ask(f"run/{key_of(run)}/{path}")
        assert answer.status == 404
        assert b"secret" not in answer.body.replace(str(tmp_path).encode(), b"")


def test_a_page_gets_what_is_recorded_and_then_what_is_new(changing, run):
    with changing.messages(key_of(run)) as messages:
        found = collected(messages, 4)
        assert found["facts"]["status"] == "stopped"
        assert found["facts"]["policies"] == [0, 300]
        assert found["episodes"]["episode_return"] == [-1.0, -2.0, -3.0]
        assert found["updates"]["loss"] == [0.5]
        assert found["validations"]["worst_return"] == [-20.0]
        with folders.lock(run):
            append(run.episodes, episode(4))
            message = next(message for message in messages if "columns" in message)
    assert message["columns"]["episode"] == [4]
    assert not message["restart"]


def test_the_first_episode_with_each_outcome_is_kept_of_a_long_record(changing, run, monkeypatch):
    monkeypatch.setattr(columns, "MOST_ROWS", 4)
    append(run.episodes, *(episode(number) for number in range(4, 20)))
    append(run.episodes, episode(20) | {"outcome": "landed"}, *map(episode, range(21, 30)))
    with changing.messages(key_of(run)) as messages:
        found = collected(messages, 4)
    assert 20 not in found["episodes"]["episode"]
    assert found["firsts"]["episode"] == [1, 20]
    assert found["firsts"]["outcome"][1] == "landed"


def test_ten_pages_get_the_same_from_one_reading(changing, run):
    with ExitStack() as stack:
        pages = [stack.enter_context(changing.messages(key_of(run))) for _ in range(10)]
        assert [collected(page, 4)["episodes"]["episode"] for page in pages] == [[1, 2, 3]] * 10
        append(run.episodes, episode(4), episode(5))
        for page in pages:
            message = next(message for message in page if "columns" in message)
            assert message["columns"]["episode"] == [4, 5]


def test_half_a_line_waits_for_its_other_half(changing, run):
    with changing.messages(key_of(run)) as messages:
        collected(messages, 4)
        with run.episodes.open("a") as file:
            file.write('{"episode": 4, "observations": 400, "episode_ret')
        append(run.updates, {"update": 2, "observations": 350, "loss": 0.25})
        assert next(m for m in messages if "columns" in m)["record"] == "updates"
        with run.episodes.open("a") as file:
            file.write('urn": 1.0, "steps": 9, "outcome": "landed", "epsilon": 0, "seconds": 1}\n')
        assert next(m for m in messages if "columns" in m)["columns"]["outcome"] == ["landed"]


def test_a_deleted_run_is_told_and_what_was_read_stays(changing, run, monkeypatch):
    monkeypatch.setattr(records, "AT_REST_SECONDS", 0.1)
    with changing.messages(key_of(run)) as messages:
        collected(messages, 4)
        run.episodes.unlink()  # as deletion does, a file at a time
        time.sleep(0.5)
        shutil.rmtree(run.path)
        status = ""
        while status != "gone":  # it may be read while it is being deleted
            told = next(messages)
            assert told.keys() == {"run", "facts"}  # and no record begins anew
            status = told["facts"]["status"]
            assert told["facts"]["env_id"] == "LunarLander-v3"


def test_a_run_whose_config_was_deleted_first_is_gone_and_what_was_read_stays(
    changing, run, monkeypatch
):
    monkeypatch.setattr(records, "AT_REST_SECONDS", 0.1)
    with changing.messages(key_of(run)) as messages:
        collected(messages, 4)
        run.config_file.unlink()
        told = next(messages)
        assert told.keys() == {"run", "facts"}
        assert (told["facts"]["status"], told["facts"]["env_id"]) == ("gone", "LunarLander-v3")


def test_a_run_that_is_made_again_is_read_anew(changing, run, monkeypatch):
    monkeypatch.setattr(records, "AT_REST_SECONDS", 0.1)
    with changing.messages(key_of(run)) as messages:
        collected(messages, 4)
        shutil.rmtree(run.path)
        assert next(messages)["facts"]["status"] == "gone"
        new_run(run.path.parent, run.name, "CartPole-v1")
        told = [next(messages) for _ in range(4)]
    facts = [message["facts"] for message in told if "facts" in message]
    assert facts[-1]["env_id"] == "CartPole-v1"
    assert {m["record"] for m in told if m.get("restart")} >= {"episodes", "updates"}


def test_a_config_that_a_link_leads_to_is_not_read(changing, run, tmp_path):
    run.config_file.rename(tmp_path / "config.toml")
    run.config_file.symlink_to(tmp_path / "config.toml")
    with changing.messages(key_of(run)) as messages:
        facts = next(messages)["facts"]
    assert facts["status"] == "damaged"
    assert "is a symbolic link" in facts["error"]


def test_values_that_no_chart_draws_are_not_sent(changing, run):
    append(run.updates, {"update": 2, "observations": 350, "loss": 0.25, "__proto__": 1.0})
    with changing.messages(key_of(run)) as messages:
        assert collected(messages, 4)["updates"].keys() == {"env_steps", "loss", "mean_q"}


def test_a_run_that_cannot_be_read_is_told_and_others_go_on(changing, run, monkeypatch):
    def fail(*_):
        raise OSError("the disk is gone")

    other = recorded_run(run.path.parent, "other")
    monkeypatch.setattr(records, "AT_REST_SECONDS", 0.1)
    with changing.messages(key_of(run), key_of(other)) as messages:
        collected(messages, 8)
        monkeypatch.setattr(records, "read_facts", fail)
        said = [next(messages)["facts"]["error"] for _ in range(2)]
        assert said == ["the disk is gone"] * 2
        monkeypatch.undo()
        assert next(messages)["facts"]["error"] == ""


def test_the_server_ends_if_it_can_read_no_more(run, monkeypatch):
    monkeypatch.setattr(records.WatchedRun, "read", lambda _self: 1 / 0)
    client = Client(Server(RunIndex(run.path.parent)))
    with ThreadPoolExecutor() as pool:
        serving = pool.submit(client.server.serve)
        with client.messages(key_of(run)) as messages:
            assert list(messages) == []
        with pytest.raises(ZeroDivisionError):
            serving.result(10)


def test_a_damaged_record_is_named_and_the_others_are_shown(changing, run):
    append(run.updates, {"update": "x"})
    with changing.messages(key_of(run)) as messages:
        found = collected(messages, 2)
    assert "updates.jsonl: line 2" in found["facts"]["error"]
    assert found["episodes"]["episode"] == [1, 2, 3]


def test_a_run_with_broken_settings_is_damaged(run, serve):
    run.config_file.write_text("seed = 'x'")
    with serve(RunIndex(run.path.parent)).messages(key_of(run)) as messages:
        facts = collected(messages, 4)["facts"]
    assert facts["status"] == "damaged"
    assert "seed" in facts["error"]


def test_a_run_that_there_is_not_is_told(client):
    with client.messages("0" * 16) as messages:
        assert next(messages) == {"run": "0" * 16, "facts": None}


def test_another_environment_has_records_and_no_flights(tmp_path, serve):
    cart = new_run(tmp_path / "runs", "cart", "CartPole-v1")
    append(cart.episodes, episode(1, outcome="terminated"))
    with serve(RunIndex(tmp_path / "runs")).messages(key_of(cart)) as messages:
        found = collected(messages, 1)
    assert not found["facts"]["is_lander"]
    assert found["episodes"]["outcome"] == ["terminated"]


def test_a_variant_of_the_lander_lands_but_cannot_be_replayed(tmp_path, serve):
    windy = new_run(tmp_path / "runs", "windy", "touchdown/LunarLanderWindy-v3")
    append(windy.episodes, episode(1, outcome="landed"))
    with serve(RunIndex(tmp_path / "runs")).messages(key_of(windy)) as messages:
        facts = collected(messages, 1)["facts"]
    assert (facts["is_lander"], facts["threshold"]) == (True, 200.0)
    assert not facts["can_replay"]


def test_hostile_names_are_escaped_in_the_page(tmp_path, serve):
    hostile = "<img src=x onerror=alert(1)>\u202e\x1b"
    folder = new_run(tmp_path / "runs", "plain")
    renamed = folder.path.rename(folder.path.with_name(hostile.replace("/", "")))
    client = serve(RunIndex(tmp_path / "runs"))
    page = (
        client.ask("").body.decode()
        + client.ask(f"?run={key_of(folders.RunFolder(renamed))}").body.decode()
    )
    assert "<img" not in page
    for character in "\u202e\x1b":
        assert character not in page


def test_a_taken_port_is_one_line():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(UserError, match=f"port = {port}: cannot be used"):
            Server(RunIndex.__new__(RunIndex), port)
    with pytest.raises(UserError, match="port = 70000"):
        Server(RunIndex.__new__(RunIndex), 70_000)


def collected(messages, records):
    """Facts and columns of the first messages, until so many records have rows."""
    found, with_rows = {}, set()
    for message in messages:
        if "facts" in message:
            found["facts"] = message["facts"]
        elif message["columns"]:
            with_rows.add((message["run"], message["record"]))
            columns = found.setdefault(message["record"], {})
            for name, values in message["columns"].items():
                columns.setdefault(name, []).extend(values)
        if len(with_rows) == records and "facts" in found:
            return found
    raise AssertionError("the stream ended")
