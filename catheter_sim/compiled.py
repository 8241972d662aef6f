"""How numerical kernels are compiled."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba


def compiled(function: Callable[..., Any]) -> Any:
    """Return `function` compiled, kept on disk where there is a folder for it.

    What is kept is renewed when the function's own file changes, not when a file that it imports does: a
    compiled function calls only compiled functions of its own file.
    """
    try:
        return numba.njit(cache=True, error_model="numpy", nogil=True)(function)
    except RuntimeError:  # neither beside its file nor in the user's own cache
        return numba.njit(error_model="numpy", nogil=True)(function)
