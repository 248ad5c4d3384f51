"""What connects, and what listens."""

import sys

import touchdown

asked: list[tuple[str, tuple]] = []
watching = False


def _watch(event: str, arguments: tuple) -> None:
    if watching and event in ("socket.bind", "socket.connect", "socket.sendto"):
        asked.append((event, arguments))
    elif watching and event == "socket.getaddrinfo":
        asked.append((event, (None, arguments[:2])))


sys.addaudithook(_watch)  # it cannot be removed, so it is added once, and switched


def test_nothing_connects_and_nothing_listens(tmp_path, monkeypatch):
    global watching  # noqa: PLW0603 - the hook cannot be given anything
    monkeypatch.chdir(tmp_path)
    small = {"hidden_sizes": (4,), "min_size": 8, "episodes": 3, "validation_period": 20}
    small |= {"validation_episodes": 1, "final_validation_episodes": 1, "test_episodes": 1}
    watching = True
    try:
        run = touchdown.train("cartpole", progress=False, **small)
        touchdown.evaluate(run, episodes=1)
        touchdown.fly(run, out="flight.gif")
        touchdown.export(run, "safetensors")
        touchdown.export(run, out="onnx")
        touchdown.evaluate("onnx/cartpole-0.onnx", env_id="CartPole-v1", episodes=1)
        touchdown.compare([run])
        touchdown.play("pid", browser=False)
    finally:
        watching = False
    # a path names a socket within this machine; a host and a port, one of a network
    assert [(event, given) for event, given in asked if not isinstance(given[1], str | bytes)] == []
