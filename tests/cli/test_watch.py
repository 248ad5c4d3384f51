"""The verb `watch` as a person starts and ends it."""

import os
import re
import signal
import subprocess
import sys
from urllib.request import urlopen

import pytest

from command_line import complaint, run
from watched_runs import recorded_run


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_page_is_served_until_the_user_ends_it(tmp_path, number):
    recorded_run(tmp_path / "runs", "one")
    with subprocess.Popen(
        [sys.executable, "-W", "error", "-m", "touchdown", "watch", "one", "--no-browser"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONUNBUFFERED": "1"},
    ) as serving:
        assert serving.stdout is not None
        address = serving.stdout.readline().removeprefix("watch: ").strip()
        assert re.fullmatch(r"http://127\.0\.0\.1:\d+/[\w-]{32}/\?run=[0-9a-f]{16}", address)
        with urlopen(address, timeout=20) as answer:  # noqa: S310 - our own server
            assert b"<title>one</title>" in answer.read()
        events = address.replace("?", "events?")
        with urlopen(events, timeout=20) as page:  # noqa: S310 - as above
            assert page.readline().startswith(b"data: ")
            serving.send_signal(number)  # with a page open
            _, said = serving.communicate(timeout=30)
    assert (serving.returncode, said) == (0, "")


def test_the_page_is_written_and_its_name_printed(tmp_path):
    recorded_run(tmp_path / "runs", "one")
    done = run("watch", "one", "--out", "page.html", cwd=tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (0, "  page.html\n", "")
    assert (tmp_path / "page.html").is_file()


def test_a_run_that_is_not_there_is_one_line(tmp_path, capsys):
    said = complaint("watch", "nope", "--runs-dir", str(tmp_path), capsys=capsys)
    assert said.startswith("run 'nope': no such folder")


def test_a_film_over_training_has_no_settings_of_other_policies(tmp_path, capsys):
    recorded_run(tmp_path / "runs", "one")
    words = ["fly", "one", "--over-training", "--runs-dir", str(tmp_path / "runs")]
    said = complaint(*words, "--env-id", "CartPole-v1", capsys=capsys)
    assert said == "--env-id: a run has its own; leave it out with --over-training"
    said = complaint(*words, "--out", "window", capsys=capsys)
    assert said == "window: must end in .gif or .mp4"
