# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""What waymark.fleet tells: line by line while it works, and a page for the browser afterwards."""
import html
import os
import pathlib
import time

from waymark import _waymark


def printable(text):
    """Fit for a terminal and a page, whatever is in names: control characters come out as their codes."""
    return _waymark._printable(os.fsencode(str(text)))


class Progress:
    """Tells what goes on, and remembers it for the report."""

    def __init__(self, say):
        self.say, self.steps, self.recordings = say, [], []

    def step(self, name, results, started):
        done = sum(not was_there for _, was_there in results)
        self.steps.append((name, len(results), done, time.monotonic() - started))
        self.say(f"{name}: {len(results)} tasks, {done} done now, {len(results) - done} were there")

    @property
    def failed(self):
        return [one for one in self.recordings if "error" in one]


def write_report(path, progress, contents, seconds):
    """A page for the browser."""
    def row(*cells):
        return "<tr>" + "".join(f"<td>{html.escape(printable(cell))}</td>" for cell in cells) + "</tr>"

    recordings = []
    for one in progress.recordings:
        if "error" in one:
            recordings.append(row(one["recording"], "failed: " + one["error"], "", "", f"{one['seconds']:.1f}"))
            continue
        tiles = one["contents"]["tiles"]
        recordings.append(row(one["recording"], "was there" if one["was_there"] else "mapped", len(tiles),
                              sum(tile["num_keyframes"] for tile in tiles), f"{one['seconds']:.1f}"))
    steps = [row(name, count, done, f"{spent:.1f}") for name, count, done, spent in progress.steps]
    parts = len({tile["frame"] for tile in contents["tiles"]})
    places = sum(not link["is_border"] for link in contents["links"])
    page = f"""<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>Waymark fleet</title>
<style>body {{ font-family: sans-serif; margin: 2em; max-width: 70em }} td, th {{ padding: .2em .8em; text-align: left }}
tr:nth-child(even) {{ background: #f0f0f0 }}</style></head><body>
<h1>{len(progress.recordings)} recordings, {len(progress.failed)} failed</h1>
<p>{len(contents["tiles"])} tiles, {sum(tile["num_keyframes"] for tile in contents["tiles"])} keyframes,
{places} places that several recordings show, {parts} connected parts; {seconds:.1f} s.</p>
<h2>Recordings</h2><table><tr><th>recording</th><th></th><th>tiles</th><th>keyframes</th><th>s</th></tr>
{"".join(recordings)}</table>
<h2>Steps</h2><table><tr><th>step</th><th>tasks</th><th>done now</th><th>s</th></tr>{"".join(steps)}</table>
</body></html>
"""
    path = pathlib.Path(path)
    with _waymark._ScratchFolder(path.parent / f".{path.name}-") as scratch:
        (scratch / path.name).write_text(page, encoding="utf-8")
        os.replace(scratch / path.name, path)
