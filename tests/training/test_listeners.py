import pytest

from touchdown.core.errors import Interrupted, UserError
from touchdown.training.listeners import ListenerError, Listeners


class Heard:
    """Keeps what it is told, and how often it is closed."""

    def __init__(self) -> None:
        self.told: list[tuple[int, dict[str, float]]] = []
        self.closed = 0

    def log(self, step, scalars) -> None:
        self.told.append((step, scalars))

    def close(self) -> None:
        self.closed += 1


class FailsToLog(Heard):
    def log(self, step, scalars) -> None:
        raise ValueError(f"no room\nfor {step}: {scalars}")


class FailsToClose(Heard):
    def close(self) -> None:
        super().close()
        raise OSError(28, "No space left on device")


class StopsInClose(Heard):
    def close(self) -> None:
        super().close()
        raise KeyboardInterrupt


def test_each_listener_has_a_dictionary_of_its_own():
    class Greedy(Heard):
        def log(self, step, scalars) -> None:
            super().log(step, dict(scalars))
            scalars.clear()

    greedy, heard, scalars = Greedy(), Heard(), {"train/loss": 0.5}
    with Listeners([greedy, heard]) as told:
        told.log(7, scalars)
    assert greedy.told == heard.told == [(7, {"train/loss": 0.5})]
    assert scalars == {"train/loss": 0.5}
    assert greedy.closed == heard.closed == 1


def test_what_a_listener_raises_is_named_on_one_line_and_everyone_is_closed():
    first, fails, after = Heard(), FailsToLog(), Heard()
    with (
        pytest.raises(ListenerError) as raised,
        Listeners([first, fails, after]) as told,
    ):
        told.log(3, {"a": 1.0})
    assert (
        str(raised.value) == "listener FailsToLog: log raised ValueError: no room for 3: {'a': 1.0}"
    )
    assert isinstance(raised.value.__cause__, ValueError)
    assert (first.told, after.told) == ([(3, {"a": 1.0})], [])
    assert [each.closed for each in (first, fails, after)] == [1, 1, 1]


def test_a_listener_that_fails_to_close_is_named_after_everyone_is_closed():
    all_of_them = [FailsToClose(), Heard(), FailsToClose()]
    said = "FailsToClose: close raised OSError: No space left"
    with pytest.raises(ListenerError, match=said), Listeners(all_of_them):
        pass
    assert [each.closed for each in all_of_them] == [1, 1, 1]


def test_the_error_that_ended_a_run_is_not_hidden_by_one_of_closing():
    heard, stopped = Heard(), Interrupted("stopped and saved")
    with pytest.raises(Interrupted) as raised, Listeners([FailsToClose(), heard]):
        raise stopped
    assert raised.value is stopped
    assert raised.value.__notes__ == [
        "listener FailsToClose: close raised OSError: No space left on device"
    ]
    assert heard.closed == 1


def test_ctrl_c_while_one_listener_closes_still_closes_the_others():
    all_of_them = [Heard(), StopsInClose(), Heard()]
    with pytest.raises(KeyboardInterrupt), Listeners(all_of_them):
        pass
    assert [each.closed for each in all_of_them] == [1, 1, 1]


def test_a_listener_that_joins_later_is_told_from_there_on_and_closed():
    early, late = Heard(), Heard()
    with Listeners([early]) as told:
        told.log(1, {"a": 1.0})
        told.add("logger 'mine'", late)
        told.log(2, {"a": 1.0})
    assert [step for step, _ in early.told] == [1, 2]
    assert [step for step, _ in late.told] == [2]
    assert late.closed == 1


@pytest.mark.parametrize("wrong", [None, "a name", len, Heard, object()])
def test_what_is_no_listener_is_refused_and_the_others_are_closed(wrong):
    heard = Heard()
    said = "must be an object with log and close"
    with pytest.raises(UserError, match=said), Listeners([heard, wrong]):
        pytest.fail("it went on")
    assert heard.closed == 1


def test_one_listener_without_a_list_is_refused():
    with pytest.raises(UserError, match="must be a list of objects with log and close"):
        Listeners(Heard())
