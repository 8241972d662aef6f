"""The inputs' curves beside a video: drawn once, with a line that runs along with the time."""

from __future__ import annotations

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from catheter_sim.channels import channel_inputs, input_channels
from catheter_sim.core.inputs import Inputs
from catheter_sim.core.robot import RobotSpec
from catheter_sim.pictures.images import INK, Picture
from catheter_sim.units import si_factor

WIDTH_SHARE = 0.3  # of a video's width
_DPI = 100
_MOST_PANELS = 6


class Curves:
    """The curves of a robot's inputs, as a strip to set beside the pictures of a video.

    Attributes:
        size: width and height [pixels].
    """

    def __init__(self, robot: RobotSpec, inputs: Inputs, width: int, height: int) -> None:
        """Draw the curves of the inputs that change, up to six; of all where none does."""
        self.size = width, height
        columns = input_channels(robot, inputs.actuation)
        values = channel_inputs(robot, inputs)
        moving = [k for k in range(len(columns)) if np.ptp(values[:, k]) > 0.0] or list(range(len(columns)))
        shown = moving[:_MOST_PANELS]
        figure = Figure(figsize=(width / _DPI, height / _DPI), dpi=_DPI, layout="constrained")
        canvas = FigureCanvasAgg(figure)
        panels = figure.subplots(len(shown), 1, sharex=True, squeeze=False)[:, 0]
        for axes, k in zip(panels, shown, strict=True):
            name, _, unit = columns[k].rpartition("_")
            axes.plot(inputs.time_s, values[:, k] / si_factor(columns[k]), color="#1f5f8b", linewidth=1.4)
            axes.set_title(f"{name.replace('_', ' ')} [{unit}]", fontsize=8, loc="left")
            axes.tick_params(labelsize=7)
            axes.spines[["top", "right"]].set_visible(False)
        panels[-1].set_xlabel("time [s]", fontsize=8)
        canvas.draw()
        self._image = np.asarray(canvas.buffer_rgba())[:height, :width, :3].copy()
        boxes = [axes.get_window_extent() for axes in panels]
        self._rows = [(height - round(box.y1), height - round(box.y0)) for box in boxes]
        ends = panels[0].transData.transform([(at, 0.0) for at in (inputs.time_s[0], inputs.time_s[-1])])[
            :, 0
        ]
        self._times, self._places = inputs.time_s[[0, -1]], ends

    def place(self, time_s: float) -> int:
        """Return the column of the strip at which a time lies [pixels]."""
        if self._times[1] <= self._times[0]:
            return round(float(self._places[0]))
        return round(float(np.interp(time_s, self._times, self._places)))

    def beside(self, image: Picture, time_s: float) -> Picture:
        """Return `image` with the strip to its right, its line at `time_s`."""
        strip = self._image.copy()
        column = min(max(self.place(time_s), 0), self.size[0] - 2)
        for top, bottom in self._rows:
            strip[max(top, 0) : bottom, column : column + 2] = INK
        return np.concatenate([image, strip], axis=1)


def strip_width(width: int) -> int:
    """Return the width of the strip in a video so wide, even [pixels]."""
    return 2 * round(WIDTH_SHARE * width / 2.0)
