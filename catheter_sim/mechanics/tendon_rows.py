"""Where the slopes of chosen tendons lie in MuJoCo's sparse rows."""

from __future__ import annotations

import mujoco
import numpy as np


class TendonRows:
    """Where the nonzero entries of chosen tendons' d(length)/d(q) lie in MuJoCo's sparse rows.

    Attributes:
        entries, columns: place in `ten_J` and degree of freedom of each, shape (e,).
        starts: first of each tendon, and behind the last, shape (t + 1,).
    """

    def __init__(self, model: mujoco.MjModel, names: list[str], dofs: set[int]) -> None:
        entries: list[int] = []
        columns: list[int] = []
        starts = [0]
        for name in names:
            tendon = model.tendon(name).id
            start, count = int(model.ten_J_rowadr[tendon]), int(model.ten_J_rownnz[tendon])
            for entry in range(start, start + count):
                if int(model.ten_J_colind[entry]) in dofs:
                    entries.append(entry)
                    columns.append(int(model.ten_J_colind[entry]))
            starts.append(len(entries))
        self.entries = np.array(entries, dtype=np.uint64)
        self.columns = np.array(columns, dtype=np.uint64)
        self.starts = np.array(starts, dtype=np.uint64)

    def lines(self, span: np.ndarray, ends: np.ndarray) -> np.ndarray:
        """Return which tendons are simple: of each its first degree of freedom, or -1, shape (t,).

        Each degree of freedom of a simple one changes the length of one span, one after another as the
        spans are.

        Args:
            span: whose length each entry changes, shape (e,).
            ends: number of spans of each tendon, shape (t,).
        """
        found = np.full(len(ends), -1, dtype=np.int64)
        for tendon, count in enumerate(ends):
            own = slice(int(self.starts[tendon]), int(self.starts[tendon + 1]))
            columns, order = self.columns[own].astype(np.int64), np.arange(count)
            if count and np.array_equal(span[own], order) and np.array_equal(columns, columns[:1] + order):
                found[tendon] = columns[0]
        return found
