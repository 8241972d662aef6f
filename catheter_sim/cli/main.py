"""Entry point of `catheter-sim`: parses, calls the verb, and turns every error into one line.

Exit status: 0 done, 1 a check failed, 2 bad usage or bad input. A broken pipe ends silently with 141, and
Ctrl-C with 130, SIGTERM with 143, SIGHUP with 129, as shells expect of a program that those signals stop.

The verbs' files import nothing heavy at their top, so that `--help` answers at once.
"""

from __future__ import annotations

import argparse
import io
import logging
import os
import shlex
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from types import ModuleType
from typing import NoReturn

from catheter_sim import __version__
from catheter_sim.cli import (
    bench,
    build,
    compare,
    control,
    diagnose,
    example,
    export,
    ik,
    import_verb,
    lab,
    list_verb,
    new,
    render,
    sense,
    simulate,
    statics,
    validate,
    view,
    which_model,
    workspace,
)
from catheter_sim.cli.arguments import split_settings
from catheter_sim.errors import LONGEST_MESSAGE, TRACEBACK_VARIABLE, InputError, RobotNote, cut
from catheter_sim.files import Stopped, unwound_by_signals
from catheter_sim.platforms import require_mujoco
from catheter_sim.progress import compilations_told, note

VERBS: dict[str, ModuleType] = {
    "list": list_verb,
    "build": build,
    "export": export,
    "simulate": simulate,
    "statics": statics,
    "render": render,
    "validate": validate,
    "diagnose": diagnose,
    "import": import_verb,
    "compare": compare,
    "new": new,
    "example": example,
    "bench": bench,
    "view": view,
    "ik": ik,
    "sense": sense,
    "control": control,
    "which-model": which_model,
    "workspace": workspace,
    "lab": lab,
}
_NOT_FINITE = "(overflow|invalid value|divide by zero|underflow) encountered"

_EPILOG = """\
exit status: 0 done, 1 a check failed, 2 bad usage or bad input (one line on stderr says what).

example:
  catheter-sim simulate neuroendoscope_section --inputs in.csv -o out.csv
  catheter-sim COMMAND --help    describes a command, with its units and an example
"""


class _Parser(argparse.ArgumentParser):
    """Raises `InputError` where argparse would print its usage and leave."""

    def error(self, message: str) -> NoReturn:
        raise InputError(message)


def parser() -> argparse.ArgumentParser:
    """Return the parser of the whole command line."""
    top = _Parser(
        prog="catheter-sim",
        description="Simulates tendon-driven medical robots in MuJoCo, checks the simulation against\n"
        "theory, and says where it is wrong, and why.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    top.add_argument("--version", action="version", version=f"catheter-sim {__version__}")
    verbs = top.add_subparsers(dest="verb", metavar="COMMAND", title="commands")
    for name, module in VERBS.items():
        summary, _, rest = (module.__doc__ or "").strip().partition("\n")
        verb = verbs.add_parser(
            name,
            help=summary.rstrip("."),
            description=summary,
            epilog=rest.strip(),
            formatter_class=argparse.RawDescriptionHelpFormatter,
            allow_abbrev=False,
        )
        module.add_arguments(verb)
    return top


def main(argv: Sequence[str] | None = None) -> int:
    """Run `catheter-sim` with `argv` (default: the process's arguments); return its exit status."""
    if sys.stdout is None:  # closed by `>&-`: the next file opened would take its place and get our prints
        return _fail("standard output is closed; send it to /dev/null where it is not wanted")
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # a sign that the terminal has not is no error
    try:
        with unwound_by_signals():
            status = _run(sys.argv[1:] if argv is None else argv)
            sys.stdout.flush()
            return status
    except InputError as error:
        return _fail(str(error))
    except BrokenPipeError:
        # The reader of our output has left; without this Python complains once more at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 141
    except Stopped as stopped:
        with suppress(OSError):  # the terminal may be what has gone
            _fail(str(stopped))
        return 128 + stopped.number
    except KeyboardInterrupt:
        _fail("interrupted")
        return 130
    except Exception as error:
        if os.environ.get(TRACEBACK_VARIABLE):
            raise
        text = f"{type(error).__name__}: {error}"
        if isinstance(error, OSError):  # a full disk, a vanished folder
            return _fail(text)
        return _fail(f"internal error: {text} (a defect: set {TRACEBACK_VARIABLE}=1 to see where)")


def _run(argv: Sequence[str]) -> int:
    try:
        arguments = parser().parse_args(split_settings(argv))
    except SystemExit as ended:  # --help and --version
        return int(ended.code or 0)
    if arguments.verb is None:
        raise InputError(f"a command is needed; choices: {', '.join(VERBS)}")
    arguments.command_line = shlex.join(["catheter-sim", *argv])
    with _known_noise_silenced(), compilations_told():
        # Here and not in each verb: every one of them uses MuJoCo sooner or later.
        require_mujoco()
        return int(VERBS[arguments.verb].run(arguments))


@contextmanager
def _known_noise_silenced() -> Iterator[None]:
    """Silence what MuJoCo and NumPy say while numbers leave the finite ones: the error's line says it.

    Any other warning is a line of its own, said once.
    """
    if os.environ.get(TRACEBACK_VARIABLE):
        yield
        return
    noisy = logging.getLogger("mujoco")  # to which the engine warns (`modelling.build`)
    noisy.addFilter(_is_error)
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", _NOT_FINITE, RuntimeWarning)
            warnings.simplefilter("always", RobotNote)
            said: set[str] = set()

            def show(message: Warning | str, category: type[Warning], *_: object, **__: object) -> None:
                what = "note" if issubclass(category, RobotNote) else "warning"
                line = f"catheter-sim: {what}: {cut(' '.join(str(message).split()), LONGEST_MESSAGE)}"
                if line not in said:
                    note(line)
                said.add(line)

            warnings.showwarning = show
            yield
    finally:
        noisy.removeFilter(_is_error)


def _is_error(record: logging.LogRecord) -> bool:
    return record.levelno >= logging.ERROR


def _fail(message: str) -> int:
    if sys.stderr is not None:
        print(f"catheter-sim: error: {cut(' '.join(message.split()), LONGEST_MESSAGE)}", file=sys.stderr)
    return 2


if __name__ == "__main__":
    sys.exit(main())
