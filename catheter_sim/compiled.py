"""How numerical kernels are compiled, and how it gets known that one is (`progress.compilations_told`)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba
from numba.core import event

from catheter_sim.progress import compilation_begins, compilation_ends


def compiled(function: Callable[..., Any]) -> Any:
    """Return `function` compiled, kept on disk where there is a folder for it.

    What is kept is renewed when the function's own file changes, not when a file that it imports does: a
    compiled function calls only compiled functions of its own file.
    """
    return _compiled(function)


def compiled_in_place(function: Callable[..., Any]) -> Any:
    """Return `function`, which makes no arrays of its own, compiled as by `compiled`.

    The arrays that it is given, and rows of these, are then used without counting who holds them, which
    costs a function of short loops a quarter of its time. It may call none but others of its kind.

    Raises:
        numba.core.errors.NumbaError: at the first call, if it does make an array.
    """
    return _compiled(function, _nrt=False)


def _compiled(function: Callable[..., Any], **options: Any) -> Any:
    options |= {"error_model": "numpy", "nogil": True}
    try:
        return numba.njit(cache=True, **options)(function)
    except RuntimeError:  # neither beside its file nor in the user's own cache
        return numba.njit(**options)(function)


class _Compilations(event.Listener):
    """Hears of every compilation; what is found on disk is none."""

    def on_start(self, event: event.Event) -> None:
        compilation_begins()

    def on_end(self, event: event.Event) -> None:
        kernel = (event.data or {}).get("dispatcher")
        module = getattr(getattr(kernel, "py_func", None), "__module__", None) or ""
        compilation_ends(not module.startswith("numba."))


event.register("numba:compile", _Compilations())
