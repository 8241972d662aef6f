"""Files that appear whole or not at all, where the package's own lie, and signals that unwind a program."""

from __future__ import annotations

import errno
import os
import re
import secrets
import shutil
import signal
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType
from typing import Any

from catheter_sim import platforms
from catheter_sim.errors import InputError

# ----------------------------------------------------------------------------------------------------
# Files that appear whole or not at all, and the removal of what a killed run left of one.
#
# A new file is written beside its target, as `.NAME.X….unfinished.SUFFIX`, and renamed once it is whole.
# Whoever writes it holds it (`platforms`), and the system lets it go when that process ends, however it
# ends. So a file of such a name that nobody holds was left by a process that was killed: the next one that
# writes into the folder removes it.

_MARK = "unfinished"
_LEFT = re.compile(rf"\..*\.[0-9a-f]{{16}}\.{_MARK}(\..*)?", re.DOTALL)
_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_LONGEST_STEM = 40  # characters of the target's name that are repeated: a name has its limit


@contextmanager
def placed_when_whole(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Give the path of an empty file that takes its place at `path` at the end, if nothing was raised.

    A link is followed, so that the file it points to is replaced. What is no regular file (a pipe, a
    device) gets the finished file's bytes instead: it must not be replaced.

    Raises:
        InputError: `path` is a folder, its folder does not exist or cannot be written, or no room is left.
    """
    target = Path(path)
    if target.is_dir():
        raise InputError(f"{path}: is a folder, a file name is needed")
    if target.exists() and not target.is_file():
        with tempfile.TemporaryDirectory() as folder:
            elsewhere = Path(folder) / f"whole{target.suffix}"
            elsewhere.touch()
            yield elsewhere
            with elsewhere.open("rb") as done, target.open("wb") as direct:
                shutil.copyfileobj(done, direct)
        return
    target = Path(os.path.realpath(target))
    remove_abandoned(target.parent)
    with _reserved(target, path) as (temporary, place):
        try:
            yield temporary
            place()
        except OSError as error:
            if error.errno not in _NO_ROOM:
                raise
            raise InputError(f"{path}: cannot be written: {error.strerror}") from None


@contextmanager
def _reserved(target: Path, path: str | os.PathLike[str]) -> Iterator[tuple[Path, Callable[[], None]]]:
    """Give an empty file beside `target`, held as long as it is written, and gone at the end in any case.

    The second is to be called when it is whole: it puts it into its place.
    """
    temporary: Path | None = None
    held: int | None = None

    def place() -> None:
        nonlocal held
        assert temporary is not None
        if platforms.WINDOWS and held is not None:
            os.close(held)
            held = None
        os.replace(temporary, target)

    try:  # before the file is there: a signal may interrupt anywhere
        while held is None:
            name = f".{target.stem[:_LONGEST_STEM]}.{secrets.token_hex(8)}.{_MARK}{target.suffix}"
            temporary = target.with_name(name)
            try:
                held = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666)
            except OSError as error:
                raise InputError(f"{path}: cannot be written: {error.strerror or error}") from None
            platforms.hold(held)
            if not temporary.exists():  # swept by another process before it was held
                os.close(held)
                held = None
        assert temporary is not None
        yield temporary, place
    finally:
        if held is not None:
            os.close(held)
        if temporary is not None:
            with suppress(OSError):  # gone to its place, or never made
                temporary.unlink()


def remove_abandoned(folder: Path) -> None:
    """Remove the files in `folder` that were begun by processes which ended before they were whole."""
    try:
        with os.scandir(folder) as entries:
            begun = [
                item.path for item in entries if item.name.startswith(".") and _LEFT.fullmatch(item.name)
            ]
    except OSError:  # whoever writes there will say so
        return
    for path in begun:
        platforms.remove_if_left(path)


def check_output_file(path: str | os.PathLike[str]) -> None:
    """Raise `InputError` if a file cannot be written at `path`, before the long work starts."""
    target = Path(path)
    if target.is_dir():
        raise InputError(f"{path}: is a folder, a file name is needed")
    folder = target.parent
    if not folder.is_dir():
        raise InputError(f"{path}: cannot be written: no folder {folder}")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise InputError(f"{path}: cannot be written: no permission to write in {folder}")


def check_output_folder(path: str | os.PathLike[str]) -> Path:
    """Return the folder `path`, which need not exist yet.

    Nothing is made here: bad input found later must not leave an empty folder behind.

    Raises:
        InputError: it is a file, or could not be made or written.
    """
    folder = Path(path)
    existing = folder.absolute()
    while not existing.exists():
        existing = existing.parent
    if not existing.is_dir():
        raise InputError(f"{path}: cannot be made a folder: {existing} is a file")
    if not os.access(existing, os.W_OK | os.X_OK):
        raise InputError(f"{path}: cannot be written: no permission to write in {existing}")
    return folder


# ----------------------------------------------------------------------------------------------------
# Signals that ask a program to end unwind it, as Ctrl-C does: what it began it takes away itself.

_LONGEST_S = 30  # to take everything away; then the system ends the program


class Stopped(KeyboardInterrupt):
    """A signal asked the program to end.

    Attributes:
        number: of the signal.
    """

    def __init__(self, number: int) -> None:
        name = signal.Signals(number).name
        super().__init__("interrupted" if number == signal.SIGINT else f"stopped by {name}")
        self.number = number


@contextmanager
def unwound_by_signals() -> Iterator[None]:
    """Raise `Stopped` where the main thread is when the first such signal comes; the others do nothing.

    A signal that was ignored before (`nohup`, a job in the background) stays ignored. Compiled code that
    calls back into Python may turn `Stopped` into an error of its own (matplotlib's converters make it a
    `ValueError`): whatever error comes out after a signal leaves as `Stopped`.
    """
    asked: list[int] = []

    def stop(number: int, frame: FrameType | None) -> None:
        if asked:  # `timeout` and some terminals ask twice: it is on its way
            return
        asked.append(number)
        platforms.set_alarm(_LONGEST_S)
        raise Stopped(number)

    with _handled(stop):
        try:
            yield
        except Exception as error:
            if asked:
                raise Stopped(asked[0]) from error
            raise
        finally:
            if asked:
                platforms.set_alarm(0)


@contextmanager
def _handled(handler: Callable[[int, FrameType | None], None]) -> Iterator[None]:
    """Give such signals to `handler`, but those that are ignored; outside the main thread change nothing."""
    before: dict[int, Any] = {}
    if threading.current_thread() is threading.main_thread():  # signals are the main thread's
        before = {number: signal.getsignal(number) for number in platforms.ending_signals()}
    taken = [number for number, old in before.items() if old not in (signal.SIG_IGN, None)]
    try:
        for number in taken:
            signal.signal(number, handler)
        yield
    finally:
        for number in taken:
            signal.signal(number, before[number])
