"""How a value that a user gave is shown in an error's one line."""

from __future__ import annotations

from typing import Any

_MOST = 60  # characters


def shown(value: Any) -> str:
    """Return what Python writes for `value`, on one line and cut short."""
    try:
        text = " ".join(repr(value).split())
    except Exception:  # whatever a user's own class, or a number of too many digits, raises
        text = f"<{type(value).__name__}>"
    return text if len(text) <= _MOST else f"{text[: _MOST - 3]}..."
