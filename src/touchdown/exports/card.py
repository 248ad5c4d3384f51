"""A model card: what a policy is and how well it flies, as a README that Hugging Face reads."""

import json
from collections.abc import Mapping
from importlib.metadata import version

from touchdown.config import toml
from touchdown.config.config import Config
from touchdown.evaluation.evaluation import Evaluation
from touchdown.evaluation.table import evaluation_rows
from touchdown.exports.agreement import Agreement
from touchdown.exports.source import Source
from touchdown.policies.weights import facts_of


def model_card(source: Source, model_file: str, agreement: Agreement | None) -> str:
    """The text of a `README.md`, YAML first, with the policy's results if it has any.

    Args:
        source: the policy.
        model_file: the name of the file beside the card.
        agreement: of an ONNX model with the policy; None for weights in our own format.

    Raises:
        UserError: one of the policy's files is broken.
    """
    evaluation = source.evaluate()
    config = source.config
    parts = [
        _header(source, evaluation),
        f"# {source.name}\n\n{_what_it_is(config)}",
        "## Results\n\n" + (_results(evaluation) if evaluation else _NO_RESULTS),
        "## Fly it\n\n" + _how_to_fly(model_file, agreement),
        f"## Settings\n\n```toml\n{toml.to_toml(config).strip()}\n```",
        "## Where it comes from\n\n" + _provenance(source),
    ]
    return "\n\n".join(parts) + "\n"


_NO_RESULTS = (
    "This run has no evaluation yet: it was exported before its test flights. "
    "How well it flies is not known."
)


def _header(source: Source, evaluation: Evaluation | None) -> str:
    """YAML, of which JSON is a part: texts are quoted as JSON quotes them."""
    config = source.config
    tags = [config.env_id, "deep-reinforcement-learning", "reinforcement-learning"]
    tags += ["touchdown", config.algorithm, config.preset]
    lines = ["---", 'library_name: "touchdown"', "tags:"]
    lines += [f"- {_quoted(tag)}" for tag in dict.fromkeys(tags)]
    if evaluation:
        summary = evaluation.summary
        mean = f"{summary.mean:.1f} +/- {summary.sd:.1f}"
        lines += [
            "model-index:",
            f"- name: {_quoted(source.name)}",
            "  results:",
            "  - task:",
            '      type: "reinforcement-learning"',
            '      name: "reinforcement-learning"',
            "    dataset:",
            f"      name: {_quoted(config.env_id)}",
            f"      type: {_quoted(config.env_id)}",
            "    metrics:",
            '    - type: "mean_reward"',
            f"      value: {_quoted(mean)}",
            '      name: "mean_reward"',
            "      verified: false",
            '    - type: "n_eval_episodes"',
            f"      value: {summary.episodes}",
            '      name: "n_eval_episodes"',
        ]
    return "\n".join([*lines, "---"])


def _what_it_is(config: Config) -> str:
    return (
        f"A greedy policy for Gymnasium's {config.env_id}, trained with touchdown "
        f"(preset `{config.preset}`, algorithm `{config.algorithm}`, training seed {config.seed})."
    )


def _results(evaluation: Evaluation) -> str:
    starts = [episode.seed for episode in evaluation.episodes]
    rows = "\n".join(f"| {name} | {cell} |" for name, cell in evaluation_rows(evaluation))
    return (
        f"{len(starts)} greedy episodes on stock Gymnasium, from environment seeds {starts[0]} to "
        f"{starts[-1]}, which neither training nor the choice of the checkpoint has seen. This is "
        "one trained agent: another training seed gives another.\n\n"
        f"| | {evaluation.name} |\n| --- | --- |\n{rows}\n\n"
        "IQM: interquartile mean, with its 95% bootstrap interval. Worst 5%: mean of the lowest."
    )


def _how_to_fly(model_file: str, agreement: Agreement | None) -> str:
    if agreement is None:
        return (
            f"```bash\ntouchdown evaluate {model_file}\n"
            f"touchdown fly {model_file} --seed 7\n```\n\n"
            f"`{model_file}` is a safetensors file: arrays by name, and no code."
        )
    return (
        f"```bash\npip install onnxruntime 'gymnasium[box2d]'\npython fly_onnx.py\n```\n\n"
        f"or, with `touchdown[onnx]`:\n\n```bash\ntouchdown evaluate {model_file}\n```\n\n"
        "Input `observations`: float32 [N, D], as the world shows them (a numbered state one-hot). "
        "Outputs `q_values`: float32 [N, A], and `action`: int64 [N], the best of them.\n\n"
        f"Checked in onnxruntime when it was exported: {agreement}."
    )


def _provenance(source: Source) -> str:
    facts = facts_of(source.weights)
    rows = {
        "run": source.name,
        "config digest": source.config.digest,
        "training seed": source.config.seed,
        "trained with": _versions(source.made.versions),
        "source": source.made.git_commit,
        "exported with": f"touchdown {version('touchdown')}",
        "checkpoint": None
        if facts.env_steps is None
        else f"after {facts.env_steps:,} observations",
    }
    return "\n".join(f"- {name}: {value}" for name, value in rows.items() if value is not None)


def _versions(versions: Mapping[str, str]) -> str | None:
    return ", ".join(f"{name} {number}" for name, number in versions.items()) or None


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)
