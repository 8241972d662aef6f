"""Where the files that come with the package lie: in the installed package, or in the source tree."""

from __future__ import annotations

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent


def assets_folder() -> Path:
    """Return the folder of meshes, pictures and example data."""
    return _existing(_PACKAGE / "_assets", _PACKAGE.parent / "assets")


def models_folder() -> Path:
    """Return the folder of generated MJCF files."""
    return _existing(_PACKAGE / "_models", _PACKAGE.parent / "models")


def _existing(installed: Path, in_source_tree: Path) -> Path:
    return installed if installed.is_dir() else in_source_tree
