"""How numerical kernels are compiled, and how it gets known that one is (`progress.compilations_told`)."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numba
from numba.core import event

from catheter_sim.mechanics.kernel_store import KernelCache
from catheter_sim.progress import compilation_begins, compilation_ends


def compiled(function: Callable[..., Any]) -> Any:
    """Return `function` compiled, kept on disk where there is a folder for it.

    What is kept is renewed when the function's own file changes or one that this file imports
    (`mechanics.kernel_store`): compiled functions may call those of other files and use their constants.
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


def inlined(function: Callable[..., Any]) -> Any:
    """Return `function` to be written out in the compiled functions that call it, before these are compiled.

    For parts of a loop where a call would count, and for long functions with one caller each: a compiled
    function is optimized once by itself and once more in each function that calls it, directly or not, which
    can be most of the time that compiling takes.
    """
    return numba.njit(inline="always")(function)


def _compiled(function: Callable[..., Any], **options: Any) -> Any:
    dispatcher = numba.njit(error_model="numpy", nogil=True, **options)(function)
    with suppress(RuntimeError):  # no folder to keep it in: compiled anew in every process
        dispatcher._cache = KernelCache(function)
    return dispatcher


class _Compilations(event.Listener):
    """Hears of every compilation; what is found on disk is none."""

    def on_start(self, event: event.Event) -> None:
        compilation_begins()

    def on_end(self, event: event.Event) -> None:
        kernel = (event.data or {}).get("dispatcher")
        module = getattr(getattr(kernel, "py_func", None), "__module__", None) or ""
        of = module.rpartition(".")[2] if module.startswith("catheter_sim.") else ""
        compilation_ends(not module.startswith("numba."), of)


event.register("numba:compile", _Compilations())
