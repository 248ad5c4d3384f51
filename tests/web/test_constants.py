"""Constants of the pages are those of Python."""

from typing import Any

import gymnasium
import pytest
from javascript import STATIC, in_node

from touchdown.core import seeding
from touchdown.core.errors import UserError
from touchdown.lander import rules
from touchdown.lander.single import LanderEnv
from touchdown.render.dashboard import OUTCOME_COLOURS
from touchdown.web import playground


@pytest.fixture(scope="module")
def found() -> dict[str, Any]:
    return in_node("constants.js", "constants", None)


def test_an_episode_has_the_length_and_the_rate_of_the_environment(found):
    assert found["MAX_STEPS"] == gymnasium.spec("LunarLander-v3").max_episode_steps
    assert found["STEPS_PER_SECOND"] == LanderEnv.metadata["render_fps"]


def test_engines_are_the_actions_of_the_environment(found):
    names = ("LEFT_ENGINE", "MAIN_ENGINE", "RIGHT_ENGINE")
    assert found["engines"] == {name: getattr(rules, name) for name in names}


def test_seeds_and_the_name_of_a_person_are_those_of_the_command(found):
    seeding.check_seed(found["MAX_SEED"])
    with pytest.raises(UserError, match="seed"):
        seeding.check_seed(found["MAX_SEED"] + 1)
    assert found["YOU"] == playground.PERSON
    template = STATIC.parent / "templates/play.html.j2"
    assert f'name="seed" min="0" max="{found["MAX_SEED"]}"' in template.read_text("utf-8")


def test_outcomes_have_the_colours_of_films(found):
    expected = {
        outcome: f"rgb({red} {green} {blue})"
        for outcome, (red, green, blue) in OUTCOME_COLOURS.items()
        if outcome != "terminated"  # of other environments
    }
    assert found["OUTCOME_COLOURS"] == expected
