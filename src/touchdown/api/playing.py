"""Writes the playground: a page in which a person and policies fly the lander."""

from pathlib import Path

from touchdown.api.policies import PolicyLike, find_policy
from touchdown.core import files, reading
from touchdown.core.browser import open_file
from touchdown.core.errors import UserError
from touchdown.core.seeding import check_seed
from touchdown.policies import lookup
from touchdown.policies.named import NamedPolicy
from touchdown.policies.names import POLICY_FILES
from touchdown.runs.folder import DEFAULT_RUNS
from touchdown.runs.run import Run
from touchdown.web import playground
from touchdown.web.playground import PagePolicy

DEFAULT_OUT = Path("playground.html")
OFFERED = ("pid", "heuristic")
"""What every page offers besides the shipped policies."""
_FLYING_FILES = (".safetensors", ".toml")
_SUFFIXES = (".html", ".htm")
START = 7  # a start from which the shipped policies land in view


def play(
    *policies: PolicyLike,
    out: Path | str | None = None,
    force: bool = False,
    seed: int = START,
    browser: bool = True,
    runs_dir: Path | str = DEFAULT_RUNS,
) -> Path:
    """Write the playground and open it: fly by hand, race policies, share a flight as a link.

    The page is one file that needs no server and no network.

    Args:
        policies: policies to race besides those that every page offers: runs, weights, gains; see
            `PolicyLike`. The first one flies when the page opens. One with the name of an offered
            policy takes its place; of two with one name, the second gets a number, as in `best-2`.
        out: the HTML file; None uses `playground.html` in the current folder and replaces an
            earlier playground there.
        force: whether to replace an existing file.
        seed: environment seed of the first start.
        browser: whether to open the page, if there is a display.
        runs_dir: folder of the runs.

    Returns:
        The file.

    Raises:
        UserError: there is no such policy, it cannot fly in a browser, or the file exists already
            or cannot be written.
    """
    check_seed(seed)
    path = DEFAULT_OUT if out is None else Path(out)
    if path.suffix.lower() not in _SUFFIXES:
        raise UserError(f"out {str(path)!r}: must end in {' or '.join(_SUFFIXES)}")
    files.check_file(path, "out")
    files.check_new(path, force=force or (out is None and _is_playground(path)))
    named = playground.distinct(_page_policy(policy, Path(runs_dir)) for policy in policies)
    taken = {policy.name for policy in named}
    others = [policy for policy in offered() if policy.name not in taken]
    with files.refusing(f"out {str(path)!r}"):
        files.write_atomic(path, playground.render([*named, *others], seed))
    if browser:
        open_file(path)
    return path


def offered() -> list[PagePolicy]:
    """The policies that every page offers."""
    names = [*lookup.shipped_names(), *OFFERED]
    return [playground.page_policy_of(lookup.load(name)) for name in names]


def _page_policy(policy: PolicyLike, runs_dir: Path) -> PagePolicy:
    if not isinstance(policy, NamedPolicy | Run):
        suffix = Path(str(policy)).suffix
        if suffix in POLICY_FILES and suffix not in _FLYING_FILES:
            raise UserError(
                f"policy {str(policy)!r}: a {suffix} file cannot fly in a browser; must be a run, "
                f"a name, or a file ending in {' or '.join(_FLYING_FILES)}"
            )
    if isinstance(policy, Run) and (code := policy.config.own_code):
        raise UserError(
            f"policy {policy.name!r}: needs code of its own ({', '.join(code.values())}), which "
            "cannot run in a browser"
        )
    return playground.page_policy_of(find_policy(policy, runs_dir, None))


def _is_playground(path: Path) -> bool:
    """Whether a file is an earlier page of this command."""
    if not path.is_file():
        return False
    title = f"<title>{playground.TITLE}</title>".encode()
    return title in reading.read_bytes(path)[:1000]
