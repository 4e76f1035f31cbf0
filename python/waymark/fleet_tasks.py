# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""The tasks of waymark.fleet, run by whichever worker: each a pure function of files."""
import ctypes
import json
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import time

import waymark
from waymark import _waymark
from waymark.fleet_workspace import Workspace, checksum_of, key_of, line_of

libc = ctypes.CDLL(None)
PR_SET_PDEATHSIG = 1  # prctl(2)


def files_of(tiles):
    return [f"tiles/{tile['checksum']}.wmap" for tile in tiles] + [f"tiles/{tile['places']}.places" for tile in tiles]


def name_of(path):
    """Of a recording, for people: whole characters, whatever bytes its file has for a name."""
    return os.fsencode(path.stem).decode(errors="replace")


def digest_recording(workspace, path):
    """What a recording holds, as a checksum; files that look as they did are not read again."""
    files = sorted(file for file in path.rglob("*") if file.is_file()) if path.is_dir() else [path]
    if not files:
        raise waymark.InputError(f"{path}: missing or empty, expected a recording")
    stats = [(str(file.relative_to(path)), file.stat().st_size, file.stat().st_mtime_ns) for file in files]
    make = lambda: {"digest": key_of([(name, checksum_of(path / name)) for name, _, _ in stats])}
    return workspace.once("digest", [str(path.resolve()), stats], make)[0]["digest"]


def make_map(workspace, path, options):
    """Maps a recording in a process of its own, so that nothing in it can take the worker along.

    That process ends with the worker, and hears of no Ctrl-C: half a recording would pass for the whole one.
    """
    program = os.environ.get("WAYMARK_PROGRAM", "")
    program = program if os.path.exists(program) else shutil.which("waymark")
    if not program:
        raise waymark.InputError(f"{socket.gethostname()}: this worker finds no program waymark, expected it in its PATH")
    with _waymark._ScratchFolder(workspace.folder / "maps" / ".run-") as folder:
        made = folder / "made.wmap"
        command = [program, "run", str(path), "--quiet", "--timing", "lockstep", "--autosave", "0", "--map-out", str(made),
                   "-o", str(folder / "out"), *options]
        done = subprocess.run(command, capture_output=True, text=True, errors="replace", check=False, start_new_session=True,
                              preexec_fn=lambda: libc.prctl(PR_SET_PDEATHSIG, signal.SIGKILL))
        if done.returncode != 0 or not made.exists():
            lines = done.stderr.strip().splitlines()
            said = lines[-1].removeprefix("error: ") if lines else f"status {done.returncode}"
            raise waymark.InputError(f"{path}: cannot be mapped: {said}" if str(path) not in said else said)
        summary = json.loads((folder / "out" / "summary.json").read_text())
        checksum = checksum_of(made)
        os.replace(made, workspace.folder / "maps" / f"{checksum}.wmap")
    return {"map": checksum, "frames": summary.get("frames")}


def cut(workspace, local, checksum, name, keyframes):
    """A map as tiles: what it is of an atlas. local: gives its path."""
    def make():
        contents, shared = _waymark._cut(workspace.folder, local(), checksum, name, keyframes)
        return {"contents": contents, "shared": shared}

    return workspace.once("cut", [checksum, name, keyframes], make,
                          files=lambda result: files_of(result["contents"]["tiles"]))


def kept_map(workspace, checksum):
    """Where the map of a recording is, here."""
    workspace.need(f"maps/{checksum}.wmap")
    return workspace.folder / "maps" / f"{checksum}.wmap"


def map_and_cut(url, recording, options, keyframes):
    """A recording as tiles, and what became of it."""
    started, workspace = time.monotonic(), Workspace(url)
    try:
        path = pathlib.Path(recording)
        if path.suffix == ".wmap":
            checksum, was_there = _waymark._checksum_of_map(path), True
            local = lambda: path
        else:
            settings = [checksum_of(word) if os.path.isfile(word) else word for word in options]
            mapped, was_there = workspace.once("map", [digest_recording(workspace, path), settings],
                                               lambda: make_map(workspace, path, options),
                                               files=lambda result: [f"maps/{result['map']}.wmap"])
            checksum = mapped["map"]
            local = lambda: kept_map(workspace, checksum)
        done, was_cut = cut(workspace, local, checksum, name_of(path), keyframes)
        workspace.write(f"recordings/{checksum}", {"name": name_of(path), "keyframes": keyframes})
        return {"recording": recording, "was_there": was_there and was_cut, "seconds": time.monotonic() - started, **done}
    except (waymark.InputError, waymark.OutputError, OSError, MemoryError, RuntimeError) as error:
        return {"recording": recording, "error": line_of(error), "seconds": time.monotonic() - started}


def recall(url, checksum):
    """A recording of an earlier fleet as tiles, as map_and_cut() gave it, or None where that cannot be had any more."""
    workspace = Workspace(url)
    known = workspace.read(f"recordings/{checksum}")
    try:
        local = lambda: kept_map(workspace, checksum)
        return cut(workspace, local, checksum, known["name"], known["keyframes"]) if known else (None, True)
    except waymark.InputError:
        return None, True


_places = {}  # Of this process: the index of a range of tiles, the last one that was asked for.


def seek(url, contents, span, recordings):
    """Which tiles of a range look like those of some recordings, one after the other."""
    results = [seek_one(url, contents, span, recording) for recording in recordings]
    return [one for found, _ in results for one in found], all(was_there for _, was_there in results)


def seek_one(url, contents, span, recording):
    workspace = Workspace(url)
    index = [tile["places"] for tile in contents["tiles"][slice(*span)]]
    tiles = [i for i, tile in enumerate(contents["tiles"]) if tile["recording"] == recording]

    def make():
        workspace.need(*(f"tiles/{places}.places" for places in index))
        workspace.need(*(f"tiles/{contents['tiles'][i]['checksum']}.wmap" for i in tiles))
        key = key_of(url, index)
        if key not in _places:
            _places.clear()
            _places[key] = _waymark._Places(workspace.folder, contents, *span)
        return [(i, _places[key].alike(i)) for i in tiles]

    inputs = [span, index, [tile["recording"] for tile in contents["tiles"]], tiles]
    return workspace.once("seek", inputs, make)


def match(url, part, pair, seed):
    """What two tiles both show, as [link, shared landmarks], or None."""
    workspace = Workspace(url)
    a, b, queries = pair

    def make():
        workspace.need(*files_of(part["tiles"]))
        return {"found": _waymark._match(workspace.folder, part, a, b, queries, seed)}

    return workspace.once("match", [[tile["checksum"] for tile in part["tiles"]], a, b, queries, seed], make)


def adjust(url, part, tile, shared):
    """The checksum of a tile that was adjusted among its neighbours."""
    workspace = Workspace(url)
    described = [[one["checksum"], one["anchor"]] for one in part["tiles"]]

    def make():
        workspace.need(*files_of(part["tiles"]))
        return {"checksum": _waymark._adjust(workspace.folder, part, tile, shared)}

    return workspace.once("adjust", [described, part["links"], tile, key_of(shared)], make,
                          files=lambda result: [f"tiles/{result['checksum']}.wmap"])


def refit(url, part, shared):
    """How two tiles lie to each other after they were adjusted."""
    workspace = Workspace(url)

    def make():
        workspace.need(*files_of(part["tiles"]))
        return _waymark._refit(workspace.folder, part, 0, shared)

    return workspace.once("refit", [[tile["checksum"] for tile in part["tiles"]], part["links"], key_of(shared)], make)
