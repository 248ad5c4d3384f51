"""What a policy takes and gives, and where its results hold, for its model card."""

from touchdown.core import markdown
from touchdown.core.types import Spaces
from touchdown.lander import rules

# units follow from gymnasium's lunar_lander.py: half a viewport is 10 m wide and 6.67 m high, and a
# second has 50 steps
_LANDER = """\
The observation is 8 numbers, as Gymnasium's lander gives them:

| | observation | one unit is |
| --- | --- | --- |
| 0 | x, from the middle of the pad; positive to the right | 10 m |
| 1 | height above a lander that stands on the pad | 6.67 m |
| 2 | horizontal velocity | 5 m/s |
| 3 | vertical velocity; positive upwards | 7.5 m/s |
| 4 | angle; positive if tilted to the left | 1 rad |
| 5 | angular velocity; positive if turning to the left | 2.5 rad/s |
| 6, 7 | whether the right and the left leg touch the ground | 0 or 1 |

The action is a number: 0 fires no engine, 1 the left one, which pushes to the right, 2 the main \
engine, 3 the right one, which pushes to the left."""

_LANDER_LIMITS = """\
Trained and tested with {settings}, 1,000 steps at most. Its performance with {others}, or \
noise in the observations, is not known. It has no continuous actions."""
_STOCK = "Gymnasium's defaults: gravity of -10, no wind"


def interface(env_id: str, spaces: Spaces) -> str:
    """The meaning of the observations and actions, as Markdown.

    Args:
        env_id: the environment.
        spaces: its spaces.
    """
    if rules.is_lander(env_id):
        return _LANDER
    if spaces.num_states is None:
        observation = f"{spaces.observation_size} numbers"
    else:
        observation = (
            f"the number of a state, from 0 to {spaces.num_states - 1}, as a one-hot vector of "
            f"{spaces.observation_size} numbers"
        )
    return (
        f"The observation is {observation}; the action is a number from 0 to "
        f"{spaces.num_actions - 1}. Their meaning is that of {markdown.text(env_id)}."
    )


def limits(env_id: str) -> str:
    """The conditions in which the results of a policy hold.

    Args:
        env_id: the environment.
    """
    if rules.is_lander(env_id):
        own = ", ".join(f"`{name}={value}`" for name, value in rules.settings_of(env_id).items())
        if not own:
            return _LANDER_LIMITS.format(
                settings=_STOCK, others="wind (`enable_wind=True`), another gravity"
            )
        return _LANDER_LIMITS.format(
            settings=f"{own} and otherwise Gymnasium's defaults", others="other wind or gravity"
        )
    return (
        f"Trained and tested in {markdown.text(env_id)} with its default settings; its performance "
        "with others is not known."
    )
