# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Many recordings into one atlas, by many processes or machines: `waymark fleet`, docs/fleet.md.

>>> from waymark import fleet
>>> result = fleet.run(["monday", "tuesday"], "campus", workers=2)

Scheduling, retries and the loss of workers are Dask's, storage is fsspec's. What is here says which
tasks there are: each is a pure function of files, and its result lies in ATLAS/work under a name
that is made of all that it depends on. What is there is not done again.
"""
import argparse
import contextlib
import html
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

try:
    import dask.distributed

    from waymark.fleet_workspace import Workspace, checksum_of, key_of, replacing
except ImportError as missing:
    raise ImportError("waymark.fleet: needs Dask and fsspec, expected the packages python3-distributed and "
                      f"python3-fsspec ({missing})") from None

import waymark
from waymark import _waymark

NUM_KEYFRAMES = 128  # Of a tile, at most.
INDEX_KEYFRAMES = 131072  # Of the part of the place index that a worker holds: 4 GB.
NUM_SEEKING_TASKS = 64  # Per such part, at least where there are as many recordings.


def files_of(tiles):
    return [f"tiles/{tile['checksum']}.wmap" for tile in tiles] + [f"tiles/{tile['places']}.places" for tile in tiles]


# Tasks, run by whichever worker.


def digest_recording(workspace, path):
    """What a recording holds, as a checksum; files that look as they did are not read again."""
    files = sorted(file for file in path.rglob("*") if file.is_file()) if path.is_dir() else [path]
    if not files:
        raise waymark.InputError(f"{path}: missing or empty, expected a recording")
    stats = [(str(file.relative_to(path)), file.stat().st_size, file.stat().st_mtime_ns) for file in files]
    make = lambda: {"digest": key_of([(name, checksum_of(path / name)) for name, _, _ in stats])}
    return workspace.once("digest", [str(path.resolve()), stats], make)[0]["digest"]


def make_map(workspace, path, options):
    """Maps a recording in a process of its own, so that nothing in it can take the worker along."""
    program = os.environ.get("WAYMARK_PROGRAM", "")
    program = program if os.path.exists(program) else shutil.which("waymark")
    if not program:
        raise waymark.InputError("waymark: missing, expected the program on the path of each worker")
    with tempfile.TemporaryDirectory(dir=workspace.folder / "maps", prefix=".run-") as folder:
        made = pathlib.Path(folder) / "made.wmap"
        command = [program, "run", str(path), "--quiet", "--timing", "lockstep", "--autosave", "0", "--map-out", str(made),
                   "-o", f"{folder}/out", *options]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0 or not made.exists():
            lines = done.stderr.strip().splitlines()
            said = lines[-1].removeprefix("error: ") if lines else f"status {done.returncode}"
            raise waymark.InputError(f"{path}: cannot be mapped: {said}" if str(path) not in said else said)
        summary = json.loads((pathlib.Path(folder) / "out" / "summary.json").read_text())
        checksum = checksum_of(made)
        os.replace(made, workspace.folder / "maps" / f"{checksum}.wmap")
    return {"map": checksum, "frames": summary.get("frames")}


def map_and_cut(url, recording, options, keyframes):
    """A recording as tiles: what it is of the atlas, and what became of it."""
    started, workspace = time.monotonic(), Workspace(url)
    try:
        path = pathlib.Path(recording)
        digest = digest_recording(workspace, path)
        if path.suffix == ".wmap":
            mapped, was_there = {"map": checksum_of(path)}, True
            local = path
        else:
            mapped, was_there = workspace.once("map", [digest, options], lambda: make_map(workspace, path, options),
                                               files=lambda result: [f"maps/{result['map']}.wmap"])
            workspace.need(f"maps/{mapped['map']}.wmap")
            local = workspace.folder / "maps" / f"{mapped['map']}.wmap"

        def cut():
            contents, shared = _waymark._cut(str(workspace.folder), str(local), mapped["map"], path.stem, keyframes)
            return {"contents": contents, "shared": shared}

        done, was_cut = workspace.once("cut", [mapped["map"], path.stem, keyframes], cut,
                                       files=lambda result: files_of(result["contents"]["tiles"]))
        workspace.write(f"recordings/{mapped['map']}", {"name": path.stem, "keyframes": keyframes})
        return {"recording": recording, "was_there": was_there and was_cut, "seconds": time.monotonic() - started, **done}
    except (waymark.InputError, waymark.OutputError, OSError, MemoryError, RuntimeError) as error:
        return {"recording": recording, "error": " ".join(str(error).split()), "seconds": time.monotonic() - started}


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
            _places[key] = _waymark._Places(str(workspace.folder), contents, *span)
        return [(i, _places[key].alike(i)) for i in tiles]

    inputs = [span, index, [tile["recording"] for tile in contents["tiles"]], tiles]
    return workspace.once("seek", inputs, make)


def part_of(contents, tiles, links):
    """Contents of these tiles and links alone, in the same order."""
    number = {tile: i for i, tile in enumerate(tiles)}
    return {"recordings": contents["recordings"], "tiles": [contents["tiles"][i] for i in tiles],
            "links": [{**link, "a": number[link["a"]], "b": number[link["b"]]} for link in links]}


def match(url, part, pair, seed):
    """What two tiles both show, as [link, shared landmarks], or None."""
    workspace = Workspace(url)
    a, b, queries = pair
    tiles = part["tiles"]

    def make():
        workspace.need(*files_of(tiles))
        return _waymark._match(str(workspace.folder), part, a, b, queries, seed)

    return workspace.once("match", [[tile["checksum"] for tile in tiles], a, b, queries, seed],
                          lambda: {"found": make()})


def adjust(url, part, tile, shared):
    """The checksum of a tile that was adjusted among its neighbours."""
    workspace = Workspace(url)
    described = [[one["checksum"], one["anchor"]] for one in part["tiles"]]

    def make():
        workspace.need(*files_of(part["tiles"]))
        return {"checksum": _waymark._adjust(str(workspace.folder), part, tile, shared)}

    return workspace.once("adjust", [described, part["links"], tile, key_of(shared)], make,
                          files=lambda result: [f"tiles/{result['checksum']}.wmap"])


def refit(url, part, shared):
    """How two tiles lie to each other after they were adjusted."""
    workspace = Workspace(url)

    def make():
        workspace.need(*files_of(part["tiles"]))
        return _waymark._refit(str(workspace.folder), part, 0, shared)

    return workspace.once("refit", [[tile["checksum"] for tile in part["tiles"]], part["links"], key_of(shared)], make)


# Who hands the tasks out.


class Progress:
    """Tells what goes on, and remembers it for the report."""

    def __init__(self, say):
        self.say, self.steps, self.recordings, self.failed = say, [], [], []

    def step(self, name, results, started):
        done = sum(not was_there for _, was_there in results)
        self.steps.append((name, len(results), done, time.monotonic() - started))
        self.say(f"{name}: {len(results)} tasks, {done} done now, {len(results) - done} were there")


def gather(client, progress, name, function, arguments):
    """The results of a task for each of the arguments, in their order."""
    started = time.monotonic()
    futures = [client.submit(function, *one, pure=False) for one in arguments]
    results = client.gather(futures)
    progress.step(name, results, started)
    return [result for result, _ in results]


def map_all(client, progress, url, recordings, options, keyframes):
    """The recordings that could be mapped, each once, ascending by their checksums."""
    started = time.monotonic()
    futures = {client.submit(map_and_cut, url, one, options, keyframes, pure=False): one for one in recordings}
    results = []
    for count, future in enumerate(dask.distributed.as_completed(futures), 1):
        name = futures[future]
        try:
            result = future.result()
        except Exception as error:  # A worker that died too often, or anything that nobody thought of.
            result = {"recording": name, "error": f"{name}: {' '.join(str(error).split()) or type(error).__name__}",
                      "seconds": 0.0}
        results.append(result)
        what = result.get("error") or ("was there" if result["was_there"] else f"{result['seconds']:.1f} s")
        progress.say(f"[{count}/{len(recordings)}] {name}: {what.removeprefix(f'{name}: ')}")
    progress.recordings = sorted(results, key=lambda result: result["recording"])
    progress.failed = [result for result in progress.recordings if "error" in result]
    mapped = [result for result in progress.recordings if "error" not in result]
    progress.steps.append(("map and cut", len(results), sum(not one["was_there"] for one in mapped),
                           time.monotonic() - started))
    by_checksum = {}
    for result in mapped:
        by_checksum.setdefault(result["contents"]["recordings"][0]["checksum"], result)
    return by_checksum


def with_published(workspace, atlas, mapped):
    """Recordings that the atlas has already stay in it, though they are not among those named now."""
    for recording in atlas.recordings:
        checksum = recording["checksum"]
        if checksum in mapped:
            continue
        known = workspace.read(f"recordings/{checksum}")
        cut = known and workspace.read(f"cut/{key_of('cut', [checksum, known['name'], known['keyframes']])}")
        if not cut:
            raise waymark.InputError(f"{recording['name']}: is in the atlas and was not put there by a fleet, "
                                     "expected an atlas of its own")
        mapped[checksum] = cut
    since = {recording["checksum"]: recording["since"] for recording in atlas.recordings}
    new = max(since.values(), default=-1) + 1
    for checksum, one in mapped.items():
        one["contents"]["recordings"][0]["since"] = since.get(checksum, new)


def link_all(client, progress, url, contents, shared, seed, index_keyframes):
    """Adds the places that recordings have in common."""
    [index] = client.scatter([contents], broadcast=True)
    # Opening a range takes a worker longer than asking it for a recording does: several at a time.
    recordings = range(len(contents["recordings"]))
    count = 1 + len(recordings) // NUM_SEEKING_TASKS
    batches = [list(recordings[first:first + count]) for first in recordings[::count]]
    alike = gather(client, progress, "look for shared places", seek,
                   [(url, index, span, batch) for span in _waymark._divide(contents, index_keyframes)
                    for batch in batches])
    pairs = _waymark._pairs(sorted((one for of_one in alike for one in of_one), key=lambda one: one[0]))
    arguments = []
    for a, b, queries in pairs:
        first, second = sorted((a, b))
        arguments.append((url, part_of(contents, [first, second], []), (int(a > b), int(b > a), queries), seed))
    for (a, b, _), result in zip(pairs, gather(client, progress, "verify and link", match, arguments)):
        if not result["found"]:
            continue
        link, landmarks = result["found"]
        first, second = sorted((a, b))
        contents["links"].append({**link, "a": first, "b": second})
        shared[landmarks[0], landmarks[1]] = landmarks


def links_by_tile(contents):
    touching = {}
    for link in contents["links"]:
        touching.setdefault(link["a"], []).append(link)
        touching.setdefault(link["b"], []).append(link)
    return touching


def adjust_all(client, progress, url, contents, shared):
    """Adjusts the tiles, group by group, and says anew how they lie to each other."""
    def landmarks_of(links):
        return [shared[contents["tiles"][link["a"]]["origin"], contents["tiles"][link["b"]]["origin"]] for link in links]

    touching = links_by_tile(contents)
    groups = _waymark._schedule(contents)
    for number, group in enumerate(groups, 1):
        arguments = []
        for tile in group:
            links = touching.get(tile, [])
            around = sorted({tile, *(link["a"] for link in links), *(link["b"] for link in links)})
            arguments.append((url, part_of(contents, around, links), around.index(tile), landmarks_of(links)))
        results = gather(client, progress, f"adjust tiles, group {number} of {len(groups)}", adjust, arguments)
        for tile, result in zip(group, results):
            contents["tiles"][tile]["checksum"] = result["checksum"]
    if groups:
        arguments = [(url, part_of(contents, [link["a"], link["b"]], [link]), landmarks_of([link]))
                     for link in contents["links"]]
        for link, fit in zip(contents["links"], gather(client, progress, "fit links", refit, arguments)):
            link["b_from_a"] = fit


def publish(workspace, folder, contents, shared):
    """Makes all of it the state of the atlas, unless it is; whether there was something to do."""
    atlas = waymark.Atlas(folder)
    before = {"recordings": atlas.recordings, "tiles": atlas.tiles, "links": atlas.links}
    if before == contents:
        return False
    names = files_of(contents["tiles"])
    workspace.need(*names)
    for name in names:
        target = pathlib.Path(folder) / name
        if not target.exists():
            with replacing(target) as temporary:
                shutil.copyfile(workspace.folder / name, temporary)
                temporary.chmod(0o644)
    _waymark._commit(str(folder), contents, list(shared.values()))
    return True


def write_report(path, progress, contents, seconds):
    """A page for the browser."""
    def row(*cells):
        return "<tr>" + "".join(f"<td>{html.escape(str(cell))}</td>" for cell in cells) + "</tr>"

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
    with replacing(pathlib.Path(path)) as temporary:
        temporary.write_text(page, encoding="utf-8")
        temporary.chmod(0o644)


def run(recordings, atlas, *, workers=None, scheduler=None, options=(), keyframes=NUM_KEYFRAMES, seed=0, report=None,
        work=None, index_keyframes=INDEX_KEYFRAMES, say=lambda line: None):
    """Maps recordings and makes one atlas of them; what is there already is not done again.

    recordings: paths that each worker can read, of whatever `waymark run` takes, or maps (.wmap).
    atlas: folder of the atlas.
    workers: processes of a local cluster, as many as cores where it is None; or
    scheduler: address of a Dask scheduler.
    options: further arguments of `waymark run`, the same for all.
    work: where steps leave what they made, an fsspec URL that all workers reach; ATLAS/work if None.
    index_keyframes: so many keyframes at most has the part of the place index that a worker holds at a time, some
    30 kB each. Which places are found depends on it a little, not on the number of workers.
    say: hears of the progress, line by line.

    Gives a dict: contents (recordings, tiles, links), failed (a list of dicts with recording and
    error) and num_done (tasks that were not there already).
    """
    started, progress = time.monotonic(), Progress(say)
    folder = pathlib.Path(atlas)
    published = waymark.Atlas(folder)
    url = str(work or (folder / "work").resolve())
    workspace = Workspace(url)
    names = sorted({str(one) for one in recordings})
    with contextlib.ExitStack() as stack:
        if scheduler is None:
            cluster = dask.distributed.LocalCluster(n_workers=workers or os.cpu_count(), threads_per_worker=1,
                                                    dashboard_address=None)
            stack.enter_context(cluster)
            scheduler = cluster.scheduler_address
        client = stack.enter_context(dask.distributed.Client(scheduler))
        mapped = map_all(client, progress, url, names, list(options), keyframes)
        with_published(workspace, published, mapped)
        ordered = [mapped[checksum] for checksum in sorted(mapped)]
        contents = _waymark._append([one["contents"] for one in ordered])
        shared = {(a, b): [a, b, landmarks] for one in ordered for a, b, landmarks in one["shared"]}
        link_all(client, progress, url, contents, shared, seed, index_keyframes)
        contents = _waymark._solve(contents)
        adjust_all(client, progress, url, contents, shared)
        contents = _waymark._solve(contents)
    is_new = publish(workspace, folder, contents, shared)
    say(f"{folder}: {'published' if is_new else 'is as it was'}, {len(contents['tiles'])} tiles of "
        f"{len(contents['recordings'])} recordings, {len(progress.failed)} failed")
    if report:
        write_report(report, progress, contents, time.monotonic() - started)
    return {"contents": contents, "failed": [{"recording": one["recording"], "error": one["error"]}
                                             for one in progress.failed],
            "num_done": sum(done for _, _, done, _ in progress.steps)}


def main(arguments=None):
    parser = argparse.ArgumentParser(prog="waymark fleet", description="Maps recordings and makes one atlas of them")
    parser.add_argument("recordings", nargs="+", metavar="RECORDING")
    parser.add_argument("-o", "--out", required=True, metavar="ATLAS")
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--workers", type=int, metavar="N")
    where.add_argument("--scheduler", metavar="ADDRESS")
    parser.add_argument("--work", metavar="URL")
    parser.add_argument("--report", metavar="FILE")
    parser.add_argument("-c", "--config", action="append", default=[], metavar="FILE")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("--setup", metavar="NAME")
    parser.add_argument("--keyframes", type=int, default=NUM_KEYFRAMES, metavar="N")
    parser.add_argument("--seed", type=int, default=0, metavar="N")
    given = parser.parse_args(arguments)
    options = [word for file in given.config for word in ("-c", str(pathlib.Path(file).resolve()))]
    options += [word for setting in given.set for word in ("--set", setting)]
    options += ["--setup", given.setup] if given.setup else []
    options += ["--seed", str(given.seed)]
    try:
        result = run([str(pathlib.Path(one).resolve()) for one in given.recordings], given.out, workers=given.workers,
                     scheduler=given.scheduler, options=options, keyframes=given.keyframes, seed=given.seed,
                     report=given.report, work=given.work, say=lambda line: print(line, file=sys.stderr, flush=True))
    except (waymark.InputError, waymark.OutputError, OSError) as error:
        print("error: " + " ".join(str(error).split()), file=sys.stderr)
        return 2 if isinstance(error, waymark.InputError) else 1
    return 3 if not result["contents"]["tiles"] else 0


if __name__ == "__main__":
    from waymark import fleet  # Tasks are functions of the module, wherever they run.
    sys.exit(fleet.main())
