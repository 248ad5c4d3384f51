"""The command line's entry point: run a verb, and turn errors into one line and an exit code."""

import contextlib
import io
import sys
import warnings
from collections.abc import Sequence

from touchdown.cli.parse import named_in, parse
from touchdown.core import plugins, processes
from touchdown.core.errors import Interrupted, UserError, is_out_of_memory, one_line
from touchdown.core.version import __version__

_BAD_INPUT = 2
_SHOWN = 200  # characters of a message that is not ours
_INTERRUPTED = 130  # what a shell reports for a program ended by Ctrl-C


def main(argv: Sequence[str] | None = None) -> None:
    """Run a verb; an error is one line on stderr.

    Args:
        argv: the words after `touchdown`; None uses those of the process.

    Raises:
        SystemExit: with code 2 for bad input, 130 after Ctrl-C, SIGTERM or SIGHUP, and 0 after
            help.
    """
    from touchdown.core.terminal import make_console  # noqa: PLC0415 - it loads rich

    args = list(sys.argv[1:] if argv is None else argv)
    if argv is None:
        processes.open_closed_streams()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # a terminal without UTF-8 still shows tables
    if argv is None:  # the process is ours
        warnings.showwarning = _show_warning
    console = make_console(on_terminal=sys.stdout.isatty(), stderr="--json" in args)
    try:
        if args == ["--version"]:
            processes.print_out(f"touchdown {__version__}\n")
            return
        with processes.stopping(processes.interrupt):
            verb = parse(args)
            plugins.allow(*named_in(args))
            trust: bool = getattr(verb, "trust", False)
            with plugins.trusting(everything=trust):
                verb.run(console)
            sys.stdout.flush()  # here, where a full disk is one line
    except UserError as error:
        _fail(str(error), _BAD_INPUT)
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        _fail(f"{where}{one_line(error)}", _BAD_INPUT)
    except (ImportError, MemoryError, RuntimeError) as error:
        if not is_out_of_memory(error):
            raise
        _fail(f"out of memory ({one_line(error)[:_SHOWN]})", _BAD_INPUT)
    except Interrupted as stopped:
        _fail(str(stopped), _INTERRUPTED)
    except KeyboardInterrupt:
        _fail("stopped", _INTERRUPTED)


def _show_warning(message: Warning | str, *_where: object) -> None:
    """Print a warning as one line, without the place in the code that is of no use here."""
    from touchdown.core.terminal import printable_line  # noqa: PLC0415 - it loads rich

    sys.stderr.write(f"touchdown: warning: {printable_line(str(message))}\n")


def _fail(message: str, code: int) -> None:
    from touchdown.core.terminal import printable_line  # noqa: PLC0415 - it loads rich

    try:
        sys.stdout.flush()
    except OSError:
        processes.silence(sys.stdout)  # or Python fails again when it ends
    with contextlib.suppress(OSError):  # a closed terminal
        sys.stderr.write(f"touchdown: {printable_line(message)}\n")
        sys.stderr.flush()
    raise SystemExit(code)


if __name__ == "__main__":
    main()
