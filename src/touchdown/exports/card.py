"""The model card of a policy: a README with metadata for Hugging Face."""

from collections.abc import Mapping

from touchdown.config import toml
from touchdown.config.config import Config
from touchdown.core import markdown
from touchdown.core.installation import DISTRIBUTION
from touchdown.core.version import __version__
from touchdown.evaluation.evaluation import Evaluation
from touchdown.evaluation.table import evaluation_rows
from touchdown.exports.agreement import Agreement
from touchdown.exports.source import Source
from touchdown.policies.weights import facts_of


def model_card(source: Source, model_file: str, agreement: Agreement | None) -> str:
    """The text of a `README.md` that begins with YAML, with the policy's results if it has any.

    Args:
        source: the policy.
        model_file: name of the model file in the folder of the card.
        agreement: agreement of an ONNX model with the policy; None for `safetensors`.

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
        "## Provenance\n\n" + _provenance(source),
    ]
    return "\n\n".join(parts) + "\n"


_NO_RESULTS = "This policy was exported before its test episodes, so its performance is not known."


def _header(source: Source, evaluation: Evaluation | None) -> str:
    """The YAML header. JSON is a subset of YAML, so texts are quoted as in JSON."""
    config = source.config
    tags = [config.env_id, "deep-reinforcement-learning", "reinforcement-learning"]
    tags += ["touchdown", config.algorithm, config.preset]
    lines = ["---", 'library_name: "touchdown"', "tags:"]
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
        f"A greedy policy for Gymnasium's {config.env_id}, trained with touchdown "
        f"(preset `{config.preset}`, algorithm `{config.algorithm}`, training seed {config.seed})."
    )


def _results(evaluation: Evaluation) -> str:
    starts = [episode.seed for episode in evaluation.episodes]
    rows = "\n".join(f"| {name} | {cell} |" for name, cell in evaluation_rows(evaluation))
    return (
        f"{len(starts)} greedy episodes on stock Gymnasium, from environment seeds {starts[0]} to "
        f"{starts[-1]}, which were used neither for training nor for selecting the checkpoint. "
        "This is one trained agent; another training seed gives a different one.\n\n"
        f"| | {evaluation.name} |\n| --- | --- |\n{rows}\n\n"
        "IQM: interquartile mean, with its 95% bootstrap interval. Worst 5%: mean of "
        "the lowest returns."
    )


def _how_to_fly(model_file: str, agreement: Agreement | None) -> str:
    if agreement is None:
        return (
            f"```bash\ntouchdown evaluate {model_file}\n"
            f"touchdown fly {model_file} --seed 7\n```\n\n"
            f"`{model_file}` is a safetensors file: it contains named arrays and no code."
        )
    return (
        f"```bash\npip install onnxruntime 'gymnasium[box2d]'\npython fly_onnx.py\n```\n\n"
        f"or, with `pip install '{DISTRIBUTION}[onnx]'`:\n\n"
        f"```bash\ntouchdown evaluate {model_file}\n```\n\n"
        "Input `observations`: float32 [N, D], as the environment returns them (Discrete "
        "states are one-hot). "
        "Outputs `q_values`: float32 [N, A], and `action`: int64 [N], the greedy action.\n\n"
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
    return "\n".join(f"- {name}: {value}" for name, value in rows.items() if value is not None)


def _versions(versions: Mapping[str, str]) -> str | None:
    return ", ".join(f"{name} {number}" for name, number in versions.items()) or None
