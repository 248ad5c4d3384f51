"""What an archive of Stable-Baselines3 says in plain text about its policy.

Its `data` is JSON, in which most values are pickles in base64. For some, the text beside the pickle
says what is needed. Only those fields are read: everything else is skipped without being made into
a value, however large it becomes.
"""

import re

import msgspec

from touchdown.core.errors import one_line

Text = str | int | float | bool | None
_CLASS = re.compile(r"<class '([\w.]+)'>")  # as printed by Python
# JSON has no such numbers, but Python writes them; a text is matched first, and kept
_NOT_JSON = re.compile(rb'("(?:[^"\\]|\\.)*")|-?Infinity|NaN', re.DOTALL)


class _Class(msgspec.Struct):
    module: Text = msgspec.field(name="__module__", default=None)


class _Space(msgspec.Struct):
    type: Text = msgspec.field(name=":type:", default=None)
    n: Text = None
    start: Text = None


class _Arguments(msgspec.Struct):
    activation_fn: Text = None
    features_extractor_class: Text = None


class Facts(msgspec.Struct):
    """The fields of `data` that matter."""

    policy_class: _Class = msgspec.field(default_factory=_Class)
    action_space: _Space = msgspec.field(default_factory=_Space)
    observation_space: _Space = msgspec.field(default_factory=_Space)
    policy_kwargs: _Arguments = msgspec.field(default_factory=_Arguments)
    last_obs: msgspec.Raw = msgspec.field(name="_last_obs", default=msgspec.Raw(b"null"))
    last_original_obs: msgspec.Raw | msgspec.UnsetType = msgspec.field(
        name="_last_original_obs", default=msgspec.UNSET
    )

    @property
    def normalised(self) -> bool | None:
        """Whether PPO or A2C trained on normalised observations or rewards; None if unknown.

        They keep the original observation beside the last one only where it was normalised.
        """
        if self.last_original_obs is msgspec.UNSET:
            return None
        if bytes(self.last_original_obs) != b"null":
            return True
        return None if bytes(self.last_obs) == b"null" else False  # it may not be trained yet


def read_facts(data: bytes) -> Facts:
    """The facts in `data`.

    Raises:
        ValueError: it is not JSON, or a field has another type.
    """
    plain = _NOT_JSON.sub(lambda found: found[1] or b"null", data)
    try:
        return msgspec.json.decode(plain, type=Facts)
    except msgspec.ValidationError as error:
        raise ValueError(f"its data is of another kind: {one_line(error)}") from None
    except (ValueError, RecursionError) as error:
        raise ValueError(f"its data is not JSON, perhaps truncated: {one_line(error)}") from None


def class_name(text: Text) -> str | None:
    """The whole name in `<class 'a.b.C'>`; other text unchanged."""
    if text is None:
        return None
    named = _CLASS.fullmatch(str(text))
    return named[1] if named else str(text)[:100]
