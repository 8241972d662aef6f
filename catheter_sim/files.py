"""Files that appear whole or not at all, and the removal of what a killed run left of one.

A new file is written beside its target, as `.NAME.X….unfinished.SUFFIX`, and renamed once it is whole.
Whoever writes it holds a lock on it, which the system lets go when that process ends, however it ends. So a
file of such a name that nobody holds was left by a process that was killed: the next one that writes into
the folder removes it.
"""

from __future__ import annotations

import errno
import os
import re
import secrets
import shutil
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

try:
    import fcntl
except ImportError:  # no POSIX: nothing is locked, so nothing is ever taken for left behind
    fcntl = None  # type: ignore[assignment]

from catheter_sim.errors import InputError

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
    with _reserved(target, path) as temporary:
        try:
            yield temporary
            os.replace(temporary, target)
        except OSError as error:
            if error.errno not in _NO_ROOM:
                raise
            raise InputError(f"{path}: cannot be written: {error.strerror}") from None


@contextmanager
def _reserved(target: Path, path: str | os.PathLike[str]) -> Iterator[Path]:
    """Give an empty file beside `target`, held as long as it is written, and gone at the end in any case."""
    temporary: Path | None = None
    held = None
    try:  # before the file is there: a signal may interrupt anywhere
        while held is None:
            name = f".{target.stem[:_LONGEST_STEM]}.{secrets.token_hex(8)}.{_MARK}{target.suffix}"
            temporary = target.with_name(name)
            try:
                held = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666)
            except OSError as error:
                raise InputError(f"{path}: cannot be written: {error.strerror or error}") from None
            if fcntl is None:
                os.close(held)
                break
            with suppress(OSError):  # a file system without locks
                fcntl.flock(held, fcntl.LOCK_EX)
            if not temporary.exists():  # swept by another process before it was held
                os.close(held)
                held = None
        assert temporary is not None
        yield temporary
    finally:
        if held is not None and fcntl is not None:
            os.close(held)
        if temporary is not None:
            with suppress(OSError):  # gone to its place, or never made
                temporary.unlink()


def remove_abandoned(folder: Path) -> None:
    """Remove the files in `folder` that were begun by processes which ended before they were whole."""
    if fcntl is None:
        return
    try:
        with os.scandir(folder) as entries:
            begun = [
                item.path for item in entries if item.name.startswith(".") and _LEFT.fullmatch(item.name)
            ]
    except OSError:  # whoever writes there will say so
        return
    for path in begun:
        with suppress(OSError):  # held by another process, or gone meanwhile
            descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                if stat.S_ISREG(os.fstat(descriptor).st_mode):
                    os.unlink(path)
            finally:
                os.close(descriptor)


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
