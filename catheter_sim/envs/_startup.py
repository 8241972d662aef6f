"""Registers the environments when Gymnasium is imported, before anything imports this package.

Installed beside the package as `_catheter_sim_startup`, which a `.pth` file of the same installation
imports when Python starts: since version 1.0 Gymnasium no longer reads the entry points by which
packages announced their environments. It costs a fraction of a millisecond, and nothing happens
until `gymnasium` is imported.
"""

from __future__ import annotations

import sys
from typing import Any


class _WhenGymnasiumIsImported:
    """A finder that finds nothing itself, but sees to the registration after Gymnasium's import."""

    def find_spec(self, name: str, path: Any = None, target: Any = None) -> Any:
        """Return Gymnasium's own spec, its execution followed by the registration; else None."""
        if name != "gymnasium":
            return None
        sys.meta_path.remove(self)  # type: ignore[arg-type]
        from importlib.util import find_spec

        spec = find_spec(name)
        if spec is None or spec.loader is None:
            return spec
        execute = spec.loader.exec_module

        def execute_and_register(module: Any) -> None:
            execute(module)
            try:
                import catheter_sim  # noqa: F401
            except ImportError:
                return  # an installation that is being taken away must not break Gymnasium

        spec.loader.exec_module = execute_and_register  # type: ignore[method-assign]
        return spec


sys.meta_path.insert(0, _WhenGymnasiumIsImported())  # type: ignore[arg-type]
