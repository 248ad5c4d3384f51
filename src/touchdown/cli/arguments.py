"""Arguments shared by several verbs."""

import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import arg

from touchdown.core.errors import UserError

RunsDir = Annotated[Path, arg(help="Folder that contains the runs.")]
Json = Annotated[bool, arg(help="Print JSON instead of a table, for scripts.")]
Device = Annotated[Literal["cpu", "gpu"], arg(help="Device that JAX computes on.")]
Engine = Annotated[
    Literal["exact", "gymnasium"] | None,
    arg(
        help="What simulates the lander: `exact`, our C++ engine, or `gymnasium`, the original. "
        "Their results are equal to the last bit. Without it, `exact` if it was built. Tests and "
        "windows always use `gymnasium`."
    ),
]
Episodes = Annotated[int, arg(help="Number of episodes, each from a different start.")]
FirstSeed = Annotated[
    int, arg(help="Environment seed of the first start; seeds below 1000000 are test starts.")
]
EnvId = Annotated[
    str | None,
    arg(
        help="Environment (Gymnasium id or module:Id) for `random` and for a file of another "
        "library that does not name one; without it, LunarLander-v3. Other policies name theirs, "
        "but one for the lander flies in any of its variants, such as "
        "touchdown/LunarLanderWindy-v3."
    ),
]
PolicyName = Annotated[
    str,
    arg(
        metavar="POLICY",
        help="A run's name or folder, pid, heuristic, random, a policy that comes with touchdown, "
        "or a file: .safetensors, .toml, .onnx, a .zip from Stable-Baselines3, or a .pth, .pt or "
        ".cleanrl_model from CleanRL.",
    ),
]
VecNormalize = Annotated[
    str | None,
    arg(
        metavar="FILE",
        help="For a Stable-Baselines3 .zip: the file that VecNormalize.save wrote, or `none` if "
        "observations were not normalised in training. Without it, the archive tells.",
    ),
]
RunName = Annotated[str, arg(metavar="RUN", help="Name or folder of a run.")]

ResultsDir = Annotated[Path, arg(help="Folder for the runs and reports of studies.")]
Scale = Annotated[
    Literal["quick", "full"],
    arg(help="Scale of the paper's studies: quick suits a laptop, full is as in the paper."),
]
LastScale = Annotated[
    Literal["quick", "full"] | None,
    arg(help="Scale of the paper's studies; without it, that of the last `study run`."),
]
Seeds = Annotated[
    int | None, arg(help="Training seeds per level; without it, the study's own number.")
]
LastSeeds = Annotated[
    int | None, arg(help="Training seeds per level; without it, as in the last `study run`.")
]
StudyName = Annotated[
    str,
    arg(
        metavar="NAME",
        help="`paper` for all of the paper's studies, `readings` for them in every reading of what "
        "the paper leaves open (with --scale full), a name from `study list`, or a .toml file.",
    ),
]

Force = Annotated[bool, arg(help="Replace the output if it exists already.")]

Trust = Annotated[
    bool,
    arg(
        help="Import the code that files name: an environment's module or an agent's class in a "
        "run's settings, in weights or in a study."
    ),
]

DEFAULT_RUNS = Path("runs")
DEFAULT_RESULTS = DEFAULT_RUNS / "studies"


def use_engine(engine: Literal["exact", "gymnasium"] | None) -> None:
    """Simulate the lander with the engine that a flag selects; None keeps the default.

    Raises:
        UserError: the exact engine was not built.
    """
    from touchdown.lander import engine as engines  # noqa: PLC0415 - heavy libraries load when used

    if engine is not None:
        engines.use_engine(engine)


def options_of(words: Sequence[str]) -> dict[str, bool | int | float | str]:
    """An agent's options from words of the form NAME=VALUE; a value is read as TOML, or is text.

    Raises:
        UserError: a word has another form, or a name is given twice.
    """
    options: dict[str, bool | int | float | str] = {}
    for word in words:
        name, equals, text = word.partition("=")
        if not (equals and name.isidentifier()):
            raise UserError(f"--options {word!r}: must be NAME=VALUE, such as alpha=0.9")
        if name in options:
            raise UserError(f"--options {word!r}: {name} is given twice")
        try:
            text = {"True": "true", "False": "false"}.get(text, text)
            options[name] = tomllib.loads(f"value = {text}")["value"]
        except tomllib.TOMLDecodeError:
            options[name] = text
    return options
