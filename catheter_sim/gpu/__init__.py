"""Many copies of a robot at once on MuJoCo Warp, on a GPU or, to be tested, on a CPU (extra `gpu`)."""

from __future__ import annotations
