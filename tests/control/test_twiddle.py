import math
from collections.abc import Callable, Sequence
from itertools import islice, pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from touchdown.control.twiddle import twiddle

Point = tuple[float, ...]
Objective = Callable[[Point], float]


def hill(top: Sequence[float], steepness: Sequence[float]) -> Objective:
    """A concave quadratic, rotated so that its axes are not those of the search."""

    def height(point: Point) -> float:
        d = [x - t for x, t in zip(point, top, strict=True)]
        cross = 0.5 * sum(a * b for a, b in pairwise(d))
        return 10 - sum(s * x * x for s, x in zip(steepness, d, strict=True)) - cross

    return height


def slow_trials(objective: Objective, start: Point, steps: Point) -> list[tuple[Point, float]]:
    """The slow twin: each point tried and its value, for 12 rounds, as in the textbook."""
    best, step = list(start), list(steps)
    best_value, tried = objective(start), [(start, objective(start))]
    for _ in range(12):
        for i in range(len(best)):
            best[i] += step[i]
            value = objective(tuple(best))
            tried.append((tuple(best), value))
            if value > best_value:
                best_value = value
                step[i] *= 1.1
                continue
            best[i] -= 2 * step[i]
            value = objective(tuple(best))
            tried.append((tuple(best), value))
            if value > best_value:
                best_value = value
                step[i] *= 1.1
                continue
            best[i] += step[i]
            step[i] *= 0.9
    return tried


def test_twiddle_finds_the_top_of_a_hill():
    height = hill((3.0, -1.0, 0.5), (1.0, 4.0, 2.0))
    *_, last = twiddle(height, (0.0, 0.0, 0.0), (1.0, 0.5, 0.1), tolerance=1e-3)
    assert last.best == pytest.approx((3.0, -1.0, 0.5), abs=0.01)
    assert last.best_value == pytest.approx(10, abs=1e-3)


def test_twiddle_tries_the_same_points_in_the_same_order_as_its_slow_twin():
    tried: list[tuple[Point, float]] = []
    height = hill((3.0, -1.0), (1.0, 4.0))

    def record(point: Point) -> float:
        tried.append((point, height(point)))
        return tried[-1][1]

    expected = slow_trials(height, (0.0, 0.0), (1.0, 0.5))
    trials = list(islice(twiddle(record, (0.0, 0.0), (1.0, 0.5), 1e-9), len(expected)))
    assert len(tried) == len(trials) == len(expected)
    for trial, (point, value), (slow_point, slow_value) in zip(
        trials, tried, expected, strict=True
    ):
        assert point == pytest.approx(slow_point, abs=1e-9)
        assert trial.value == value == pytest.approx(slow_value, abs=1e-9)


def test_the_first_trials_are_the_start_a_step_up_and_where_that_fails_a_step_down():
    tried: list[Point] = []

    def objective(point: Point) -> float:
        tried.append(point)
        return -abs(point[0] + 8) - abs(point[1] - 100)  # left, and up

    list(islice(twiddle(objective, (0.0, 0.0), (2.0, 10.0)), 6))
    assert tried == [
        (0, 0),
        (2, 0),  # worse
        (-2, 0),  # better: kept, and the step is 2.2 from now on
        (-2, 10),  # better: no step down
        (pytest.approx(0.2), 10),
        (pytest.approx(-4.2), 10),
    ]


@given(
    top=st.lists(st.floats(-5, 5), min_size=2, max_size=2),
    noise=st.integers(1, 7),
    tolerance=st.floats(0.05, 0.9),
)
def test_the_best_never_falls_and_is_always_the_best_of_what_was_tried(
    top: list[float], noise: int, tolerance: float
):
    height, tried = hill(top, (1.0, 2.0)), []

    def bumpy(point: Point) -> float:
        tried.append((height(point) + math.sin(noise * sum(point)), point))
        return tried[-1][0]

    for trial in islice(twiddle(bumpy, (0.0, 0.0), (1.0, 1.0), tolerance), 300):
        assert trial.value == tried[-1][0]
        assert (trial.best_value, trial.best) == max(tried, key=lambda each: each[0])


def test_the_objective_is_called_once_a_trial_and_only_when_the_trial_is_asked_for():
    calls = 0

    def flat(_: Point) -> float:
        nonlocal calls
        calls += 1
        return 0.0

    search = twiddle(flat, (0.0, 0.0, 0.0), (1.0, 2.0, 3.0), tolerance=0.5)
    assert calls == 0
    for count, _ in enumerate(search, start=1):
        assert calls == count
    assert calls == 1 + 7 * 3 * 2  # 0.9⁷ is the first below ½; up and down for each of three


def test_on_a_plateau_steps_shrink_together_from_one_to_the_tolerance():
    steps = [trial.step for trial in twiddle(lambda _: 0.0, (0.0, 0.0), (1.0, 50.0), 0.5)]
    assert steps[:3] == [1.0, 1.0, 1.0]
    assert steps[-2:] == pytest.approx([0.9**6] * 2)
    assert steps == sorted(steps, reverse=True)


def test_the_search_continues_until_every_step_is_small():
    def ramp(point: Point) -> float:
        return min(point[0], 100.0)  # up for long; the other coordinate is a plateau

    *_, last = twiddle(ramp, (0.0, 0.0), (1.0, 1.0), tolerance=0.5)
    assert last.best_value == 100


def test_tolerance_is_a_share_of_each_first_step():
    for size in (1e-6, 1.0, 1e6):
        assert len(list(twiddle(lambda _: 0.0, (0.0,), (size,), 0.5))) == 1 + 7 * 2


def test_an_equal_value_is_not_a_success():
    *_, last = twiddle(lambda _: 0.0, (4.0,), (1.0,))
    assert last.best == (4.0,)


@pytest.mark.parametrize(
    ("start", "steps", "tolerance", "named"),
    [
        ((0.0, 0.0), (1.0,), 0.1, "2 coordinates need as many steps, got 1"),
        ((0.0,), (1.0, 1.0), 0.1, "1 coordinates need as many steps, got 2"),
        ((), (), 0.1, "0 coordinates"),
        ((0.0, 0.0), (1.0, 0.0), 0.1, r"steps must be above 0, got \[1.0, 0.0\]"),
        ((0.0, 0.0), (-1.0, 1.0), 0.1, "steps must be above 0"),
        ((0.0,), (1.0,), 0.0, "tolerance must be between 0 and 1, got 0.0"),
        ((0.0,), (1.0,), 1.0, "tolerance must be between 0 and 1, got 1.0"),
        ((0.0,), (1.0,), math.nan, "tolerance must be between 0 and 1, got nan"),
    ],
)
def test_invalid_arguments_are_refused_before_the_first_trial(
    start: Point, steps: Point, tolerance: float, named: str
):
    def never(_: Point) -> float:
        raise AssertionError("it was tried")

    with pytest.raises(ValueError, match=named):
        next(twiddle(never, start, steps, tolerance))
