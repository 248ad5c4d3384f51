"""The playground: one page in which a person and policies fly the lander."""

import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import chain, count
from typing import Any

import numpy as np

from touchdown.agents.greedy import GreedyPolicy
from touchdown.control.pid import PIDPolicy
from touchdown.core import files
from touchdown.core.errors import UserError
from touchdown.lander import rules
from touchdown.policies.baselines import HeuristicPolicy, RandomPolicy
from touchdown.policies.named import NamedPolicy
from touchdown.policies.weights import WEIGHTS_FORMAT_VERSION
from touchdown.web import page

TITLE = "Touchdown playground"
PERSON = "you"
"""How the page names the person who flies, so no policy may have this name."""


@dataclass(frozen=True, slots=True)
class PagePolicy:
    """A policy as the page flies it."""

    name: str
    kind: str
    """`network`, `pid`, `heuristic` or `random`."""
    gains: dict[str, Any] | None = None
    """Of a PID controller."""
    weights: bytes | None = None
    """Of a network, as a safetensors file."""

    def to_json(self) -> dict[str, Any]:
        """The description for the page's script; weights are embedded as a file."""
        described: dict[str, Any] = {"name": self.name, "kind": self.kind}
        if self.gains is not None:
            described["gains"] = self.gains
        if self.weights is not None:
            described["file"] = _file_of(self)
        return described


def page_policy_of(named: NamedPolicy) -> PagePolicy:
    """A policy as a page flies it.

    Raises:
        UserError: it acts in another environment, or it cannot be computed in a browser.
    """
    name, policy = named.name, named.policy
    if name == PERSON:
        raise UserError(
            f"policy {name!r}: the page gives this name to the person who flies; give the run or "
            "the file another one"
        )
    if named.env_id not in (rules.LANDER_ID, rules.EXACT_ID):
        raise UserError(f"policy {name!r}: acts in {named.env_id}; must act in {rules.LANDER_ID}")
    if isinstance(policy, PIDPolicy):
        return PagePolicy(name, "pid", gains=asdict(policy.config))
    if isinstance(policy, HeuristicPolicy):
        return PagePolicy(name, "heuristic")
    if isinstance(policy, RandomPolicy):
        return PagePolicy(name, "random")
    if isinstance(policy, GreedyPolicy) and "network" in policy.describe():
        return PagePolicy(name, "network", weights=_weights_of(policy, named.reward_scale))
    raise UserError(
        f"policy {name!r}: cannot fly in a browser; must be a network of touchdown, or a PID "
        "controller, heuristic or random"
    )


def render(policies: Sequence[PagePolicy], seed: int) -> str:
    """The playground as one HTML file, which opens from disk.

    Args:
        policies: the policies, each under a name of its own; the first one flies when the page
            opens.
        seed: seed of the first start.
    """
    weights = {_file_of(each): each.weights for each in policies if each.weights is not None}
    return page.render(
        "play.html.j2",
        title=TITLE,
        data={"seed": seed, "policies": [policy.to_json() for policy in policies]},
        binaries={page.ENGINE: page.static_file(page.ENGINE), **weights},
    )


def distinct(policies: Iterable[PagePolicy]) -> list[PagePolicy]:
    """Each policy once; where another one has its name, with a number, as in `best-2`."""
    found: dict[str, PagePolicy] = {}
    seen: list[PagePolicy] = []
    for policy in policies:
        if policy in seen:
            continue
        seen.append(policy)
        numbered = (f"{policy.name}-{number}" for number in count(2))
        name = next(name for name in chain([policy.name], numbered) if name not in found)
        found[name] = replace(policy, name=name)
    return list(found.values())


def _file_of(policy: PagePolicy) -> str:
    return f"{policy.name}.safetensors"


def _weights_of(policy: GreedyPolicy, reward_scale: float) -> bytes:
    layers = policy.network.layers(np.asarray(policy.params))
    metadata = {
        "format_version": str(WEIGHTS_FORMAT_VERSION),
        "env_id": rules.LANDER_ID,
        "network": json.dumps(policy.describe()["network"]),
        "reward_scale": str(reward_scale),
    }
    tensors = {name: np.ascontiguousarray(layer, np.float32) for name, layer in layers.items()}
    return files.to_safetensors(tensors, metadata)
