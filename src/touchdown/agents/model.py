"""What a built-in agent learns, as a function of flat parameters: a network or a table."""

from collections.abc import Mapping
from typing import Any, Protocol

from touchdown.core.types import FloatArray, Policy, Tensors


class Model(Protocol):
    """A function of flat parameters [P]."""

    def layers(self, params: FloatArray) -> Mapping[str, Any]:
        """The parameters by name, each in its own shape."""
        ...

    def params_of(self, layers: Tensors) -> FloatArray:
        """Flat parameters from named ones, the inverse of `layers`.

        Raises:
            ValueError: the names, shapes or types are not those of this model.
        """
        ...

    def policy(self, params: FloatArray) -> Policy:
        """The greedy policy of these parameters."""
        ...
