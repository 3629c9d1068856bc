"""An animation of a run: the section through the contact beside the load over depth, as a GIF and, where
ffmpeg is there, an MP4.

   gimp3d-post movie [options] RUN

   --fps N          frames a second (8)
   --size N         height of the picture, pixels (720)

movie.gif, movie.mp4   in the directory of the run; a frame for each snapshot (`every` of &output says how
                       many), colours and view those of the largest load in all of them"""

import argparse
import os
import sys
from pathlib import Path

import numpy as np
from matplotlib.animation import FFMpegWriter, PillowWriter

from . import plots
from .plots import plt
from .run_data import Particles, Unreadable, snapshot_paths

dots = 120  # an inch


class Frames:
    """The figure, drawn anew for each snapshot: `draw(path)`."""

    def __init__(self, run, height):
        self.run = run
        self.paths = snapshot_paths(run.directory)
        if len(self.paths) < 2:
            raise Unreadable(f"{run.directory}: there are {len(self.paths)} snapshots, and nothing moves")
        highest = Particles(plots.at_largest_load(run, self.paths))
        section = plots.Section(run, highest)
        self.view = section.views[-1]
        self.label, values, self.unit = section.panels[1]
        self.limits = section.limits(values)
        self.curve = self.load_curve()
        inches = height / dots
        wide = min(max((self.view[1] - self.view[0]) / (self.view[3] - self.view[2]), 0.6), 2.0)
        shape = (inches * (wide * 0.75 + (0.9 if self.curve else 0.3)), inches)
        self.figure = plt.figure(figsize=tuple(2 * round(side * dots / 2) / dots for side in shape), dpi=dots)

    def load_curve(self):
        """Name, time, depth and load of the first tool that bears a load; None where there is none."""
        for tool in self.run.tools:
            history = self.run.tool_history(tool)
            if history is None or history.rows < 2:
                continue
            try:
                depth, load, _ = plots.load_curve(self.run, tool, history)
            except Unreadable:
                continue
            if np.nanmax(load) > 0:
                return tool["name"][0], history["time"], depth, load
        return None

    def draw(self, path):
        particles = Particles(path)
        self.figure.clear()
        grid = self.figure.add_gridspec(1, 2 if self.curve else 1, width_ratios=[3, 2] if self.curve else [1])
        ax = self.figure.add_subplot(grid[0])
        section = plots.Section(self.run, particles)
        _, values, unit = section.panels[1]
        drawn, name, _ = section.draw(ax, values, unit, self.view)
        factor, name = plots.scaled(self.unit, self.limits) if self.unit == "Pa" else (1.0, name)
        drawn.set_array(values / factor)
        drawn.set_clim(*(limit / factor for limit in self.limits))
        self.figure.colorbar(
            drawn, ax=ax, label=f"{self.label} [{name}]", extend="max", location="top", aspect=40
        )
        if self.curve:
            self.draw_curve(self.figure.add_subplot(grid[1]), particles.time)
        factor, unit = plots.scaled("s", [Particles(self.paths[-1]).time])
        self.figure.suptitle(f"{self.run.title}, {particles.time / factor:.4g} {unit}", fontsize=10)

    def draw_curve(self, ax, time):
        name, times, depth, load = self.curve
        depth_factor, depth_unit = plots.scaled("m", depth)
        load_factor, load_unit = plots.scaled("N", load)
        ax.plot(depth / depth_factor, load / load_factor, color="0.8")
        past = times <= time * (1 + 1e-9)
        ax.plot(depth[past] / depth_factor, load[past] / load_factor, color="C0")
        if past.any():
            ax.plot(depth[past][-1] / depth_factor, load[past][-1] / load_factor, "o", color="C3")
        ax.set(xlabel=f"depth [{depth_unit}]", ylabel=f"load on {name}, full body [{load_unit}]")


def write(frames, writer, path):
    """Under another name first: an animation is complete or not there."""
    partial = path.with_name(f".part-{path.name}")
    try:
        with writer.saving(frames.figure, partial, dots):
            for snapshot in frames.paths:
                frames.draw(snapshot)
                writer.grab_frame()
        os.replace(partial, path)
    finally:
        partial.unlink(missing_ok=True)
    print(path)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("run", type=Path)
    parser.add_argument("--fps", type=int, default=8)
    parser.add_argument("--size", type=int, default=720)
    options = parser.parse_args()
    try:
        if not options.run.is_dir():
            raise Unreadable(f"{options.run}: no such directory")
        if options.fps < 1 or not 200 <= options.size <= 4000:
            raise Unreadable("--fps is 1 or more, --size from 200 to 4000")
        frames = Frames(plots.Run(options.run), options.size)
        plt.rcParams["figure.constrained_layout.use"] = True
        write(frames, PillowWriter(fps=options.fps), options.run / "movie.gif")
        if FFMpegWriter.isAvailable():
            write(frames, FFMpegWriter(fps=options.fps, bitrate=4000), options.run / "movie.mp4")
        else:
            print("movie.mp4 is left out: ffmpeg is not there (apt-get install ffmpeg)", file=sys.stderr)
    except (Unreadable, KeyError) as error:
        print(f"movie: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
