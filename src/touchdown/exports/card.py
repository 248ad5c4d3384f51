"""The model card of a policy: a README with metadata for Hugging Face."""

import shlex
from collections.abc import Mapping
from pathlib import Path

from touchdown.config import toml
from touchdown.config.config import Config
from touchdown.core import markdown
from touchdown.core.installation import DISTRIBUTION
from touchdown.core.types import Spaces
from touchdown.core.version import __version__
from touchdown.evaluation.evaluation import Evaluation, is_lander
from touchdown.evaluation.table import evaluation_rows
from touchdown.exports.agreement import Agreement
from touchdown.exports.interface import interface, limits
from touchdown.exports.source import Source
from touchdown.policies.weights import facts_of

_SIMULATOR = " on stock Gymnasium"
_FUEL = " Fuel: return points spent on engines."


def model_card(
    source: Source, spaces: Spaces, model_file: str, agreement: Agreement | None, film: str
) -> str:
    """The text of a `README.md` that begins with YAML, with the policy's results if it has any.

    Args:
        source: the policy.
        spaces: its environment's spaces.
        model_file: name of the model file in the folder of the card.
        agreement: agreement of an ONNX model with the policy; None for `safetensors`.
        film: name of the film in that folder; "" if there is none.

    Raises:
        UserError: one of the policy's files is broken.
    """
    evaluation = source.evaluate()
    config = source.config
    shown = markdown.image(f"A test episode of {source.name}", Path(film)) if film else ""
    parts = [
        _header(source, evaluation),
        f"# {markdown.text(source.name)}",
        _what_it_is(config),
        shown,
        "## Results",
        _results(evaluation) if evaluation else _NO_RESULTS,
        "## Observations and actions",
        interface(config.env_id, spaces),
        "## Limits",
        limits(config.env_id),
        "## Use",
        _how_to_use(model_file, agreement),
        "## Settings",
        markdown.block("toml", toml.to_toml(config).strip()),
        "## Provenance",
        _provenance(source),
        "## Licence",
        f"`{source.licence}`, like touchdown's." if source.licence else _NO_LICENCE,
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


_NO_RESULTS = "This policy was exported before its test episodes, so its performance is not known."
_NO_LICENCE = (
    "None is stated: whoever publishes this policy chooses one, and writes it here and, as "
    "`license`, in the header."
)


def _header(source: Source, evaluation: Evaluation | None) -> str:
    """The YAML header. JSON is a subset of YAML, so texts are quoted as in JSON."""
    config = source.config
    tags = [config.env_id, "deep-reinforcement-learning", "reinforcement-learning"]
    tags += ["touchdown", config.algorithm, config.preset]
    lines = ["---"]
    lines += [f"license: {markdown.yaml_text(source.licence)}"] if source.licence else []
    lines += ['library_name: "touchdown"', "tags:"]
    lines += [f"- {markdown.yaml_text(tag)}" for tag in dict.fromkeys(tags)]
    if evaluation:
        summary = evaluation.summary
        mean = f"{summary.mean_return:.1f} +/- {summary.sd_return:.1f}"
        lines += [
            "model-index:",
            f"- name: {markdown.yaml_text(source.name)}",
            "  results:",
            "  - task:",
            '      type: "reinforcement-learning"',
            '      name: "reinforcement-learning"',
            "    dataset:",
            f"      name: {markdown.yaml_text(config.env_id)}",
            f"      type: {markdown.yaml_text(config.env_id)}",
            "    metrics:",
            '    - type: "mean_reward"',
            f"      value: {markdown.yaml_text(mean)}",
            '      name: "mean_reward"',
            "      verified: false",
            '    - type: "n_eval_episodes"',
            f"      value: {summary.episodes}",
            '      name: "n_eval_episodes"',
        ]
    return "\n".join([*lines, "---"])


def _what_it_is(config: Config) -> str:
    return (
        f"A greedy policy for the environment {markdown.text(config.env_id)}, trained with "
        f"touchdown (preset {markdown.code(config.preset)}, "
        f"algorithm {markdown.code(config.algorithm)}, training seed {config.seed})."
    )


def _results(evaluation: Evaluation) -> str:
    starts = [episode.seed for episode in evaluation.episodes]
    rows = "\n".join(f"| {name} | {cell} |" for name, cell in evaluation_rows(evaluation))
    simulator, fuel = (_SIMULATOR, _FUEL) if is_lander(evaluation) else ("", "")
    return (
        f"{len(starts)} greedy episodes{simulator}, from environment seeds {starts[0]} to "
        f"{starts[-1]}, which were used neither for training nor for selecting the checkpoint. "
        "This is one trained agent; another training seed gives a different one.\n\n"
        f"| | {markdown.text(evaluation.name)} |\n| --- | --- |\n{rows}\n\n"
        "IQM: interquartile mean, with its 95% bootstrap interval. Worst 5%: mean of "
        f"the lowest returns.{fuel}"
    )


def _how_to_use(model_file: str, agreement: Agreement | None) -> str:
    model = shlex.quote(model_file)
    if agreement is None:
        commands = f"touchdown evaluate {model}\ntouchdown fly {model} --seed 7"
        return (
            f"{markdown.block('bash', commands)}\n\n"
            f"{markdown.code(model_file)} is a safetensors file: it contains named arrays and no "
            "code."
        )
    alone = "pip install onnxruntime 'gymnasium[box2d]'\npython fly_onnx.py"
    return (
        f"{markdown.block('bash', alone)}\n\n"
        f"or, with `pip install '{DISTRIBUTION}[onnx]'`:\n\n"
        f"{markdown.block('bash', f'touchdown evaluate {model}')}\n\n"
        "Input `observations`: float32 [N, D]. Outputs `q_values`: float32 [N, A], and `action`: "
        "int64 [N], the greedy action.\n\n"
        f"Checked in onnxruntime at export: {agreement}."
    )


def _provenance(source: Source) -> str:
    facts = facts_of(source.weights)
    rows = {
        "run": source.name,
        "config digest": source.config.digest,
        "training seed": source.config.seed,
        "trained with": _versions(source.made.versions),
        "source": source.made.git_commit,
        "exported with": f"touchdown {__version__}",
        "checkpoint": None
        if facts.env_steps is None
        else f"after {facts.env_steps:,} environment steps",
    }
    return "\n".join(
        f"- {name}: {markdown.text(str(value))}"
        for name, value in rows.items()
        if value is not None
    )


def _versions(versions: Mapping[str, str]) -> str | None:
    return ", ".join(f"{name} {number}" for name, number in versions.items()) or None
