# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Many recordings into one atlas, by many processes or machines: `waymark fleet`, docs/fleet.md.

>>> from waymark import fleet
>>> result = fleet.run(["monday", "tuesday"], "campus", workers=2)

Scheduling, retries and the loss of workers are Dask's, storage is fsspec's. What is here says in
which order the tasks of waymark.fleet_tasks are done. The result of each lies in ATLAS/work under a
name that is made of all that it depends on. What is there is not done again.
"""
import argparse
import concurrent.futures
import contextlib
import logging
import multiprocessing.resource_tracker
import os
import pathlib
import signal
import sys
import tempfile
import time

try:
    import dask.distributed

    from waymark.fleet_workspace import Workspace, checksum_of, line_of
except ImportError as missing:
    raise ImportError("waymark.fleet: needs Dask and fsspec, expected the packages python3-distributed and "
                      f"python3-fsspec ({missing})") from None

import waymark
from waymark import _waymark
from waymark.fleet_report import Progress, printable, write_report
from waymark.fleet_tasks import adjust, files_of, map_and_cut, match, recall, refit, seek

NUM_KEYFRAMES = 128  # Of a tile, at most.
INDEX_KEYFRAMES = 131072  # Of the part of the place index that a worker holds: 4 GB.
NUM_SEEKING_TASKS = 64  # Per such part, at least where there are as many recordings.


# Who does the tasks.


@contextlib.contextmanager
def connected(workers, scheduler, say):
    """A client of a scheduler, or of a cluster of this machine alone."""
    with contextlib.ExitStack() as stack:
        if scheduler is None:
            # Threads and processes that begin here hear of no Ctrl-C: it is this process which ends them.
            multiprocessing.resource_tracker.ensure_running()  # Else that comes later, and lets them hear again.
            heard = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
            try:
                folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="waymark-fleet-", ignore_cleanup_errors=True))
                cluster = dask.distributed.LocalCluster(n_workers=workers or os.cpu_count(), threads_per_worker=1,
                                                        dashboard_address=":0", local_directory=folder)
                stack.enter_context(cluster)
            finally:
                signal.pthread_sigmask(signal.SIG_SETMASK, heard)
            scheduler = cluster.scheduler_address
        try:
            client = stack.enter_context(dask.distributed.Client(scheduler))
        except (OSError, ValueError, TypeError) as error:
            # Holds the client, which else would be closed here, and wait for that.
            raise waymark.InputError(f"{scheduler}: no Dask scheduler answers ({line_of(error)}), expected an address as "
                                     "tcp://host:8786") from error
        if not client.scheduler_info()["workers"]:
            say(f"{scheduler}: has no workers yet")
        client.wait_for_workers(1)
        check_workers(client)
        try:
            yield client
        except concurrent.futures.CancelledError:
            raise waymark.OutputError(f"{scheduler}: the scheduler has ended, expected it to stay; "
                                      "run it again and it goes on from where it was") from None


def check_workers(client):
    """InputError where a worker has not what the tasks need: they would fail there, one after the other."""
    def version():  # Goes there as a whole: the module may be missing.
        try:
            import waymark.fleet_tasks
        except ImportError as error:
            return f"none ({error})"
        return waymark.__version__

    for address, found in sorted(client.run(version).items()):
        if found != waymark.__version__:
            raise waymark.InputError(f"{address}: this worker has of the Python module waymark {found}, expected "
                                     f"{waymark.__version__}; install python3-waymark where it runs, or start it with the "
                                     "folder of the module in PYTHONPATH")


def gather(client, progress, name, function, arguments):
    """The results of a task for each of the arguments, in their order."""
    started = time.monotonic()
    futures = [client.submit(function, *one, pure=False) for one in arguments]
    results = client.gather(futures)
    progress.step(name, results, started)
    return [result for result, _ in results]


# In which order.


def map_all(client, progress, url, recordings, options, keyframes):
    """The recordings that could be mapped, each once, by their checksums."""
    started = time.monotonic()
    futures = {client.submit(map_and_cut, url, one, options, keyframes, pure=False): one for one in recordings}
    for count, future in enumerate(dask.distributed.as_completed(futures), 1):
        name = futures[future]
        try:
            result = future.result()
        except concurrent.futures.CancelledError:  # The scheduler is gone.
            raise
        except Exception as error:  # A worker that died too often, or anything that nobody thought of.
            result = {"recording": name, "error": f"{name}: {line_of(error)}", "seconds": 0.0}
        progress.recordings.append(result)
        what = result.get("error") or ("was there" if result["was_there"] else f"{result['seconds']:.1f} s")
        progress.say(f"[{count}/{len(recordings)}] {name}: {what.removeprefix(f'{name}: ')}")
    progress.recordings.sort(key=lambda result: result["recording"])
    mapped = [one for one in progress.recordings if "error" not in one]
    progress.steps.append(("map and cut", len(recordings), sum(not one["was_there"] for one in mapped),
                           time.monotonic() - started))
    by_checksum = {}
    for result in mapped:
        by_checksum.setdefault(result["contents"]["recordings"][0]["checksum"], result)
    return by_checksum


def part_of(contents, tiles, links):
    """Contents of these tiles and links alone, in the same order."""
    number = {tile: i for i, tile in enumerate(tiles)}
    return {"recordings": contents["recordings"], "tiles": [contents["tiles"][i] for i in tiles],
            "links": [{**link, "a": number[link["a"]], "b": number[link["b"]]} for link in links]}


def taken_from(atlas, workspace, recording):
    """A recording of the atlas that no fleet put there, as if its tiles had been cut as they are now."""
    number = [one["checksum"] for one in atlas.recordings].index(recording["checksum"])
    tiles = [i for i, tile in enumerate(atlas.tiles) if tile["recording"] == number]
    borders = [(i, link) for i, link in enumerate(atlas.links) if link["is_border"] and link["a"] in tiles]
    contents = {"recordings": [recording], "tiles": [{**tile, "recording": 0} for tile in atlas.tiles]}
    part = part_of(contents, tiles, [link for _, link in borders])
    for name in files_of(part["tiles"]):
        workspace.take(atlas.folder / name)
    shared = [[atlas.tiles[link["a"]]["origin"], atlas.tiles[link["b"]]["origin"], _waymark._shared(atlas, i)]
              for i, link in borders]
    return {"contents": part, "shared": shared}


def with_published(client, progress, url, atlas, mapped):
    """What was mapped, and the recordings that the atlas has already: they stay in it, whether named now or not."""
    workspace, result = Workspace(url), dict(mapped)
    others = [recording for recording in atlas.recordings if recording["checksum"] not in mapped]
    recalled = gather(client, progress, "recall what the atlas has", recall, [(url, one["checksum"]) for one in others])
    for recording, cut in zip(others, recalled):
        result[recording["checksum"]] = cut or workspace.once(
            "take", [recording["checksum"]], lambda: taken_from(atlas, workspace, recording),
            files=lambda taken: files_of(taken["contents"]["tiles"]))[0]
    since = {recording["checksum"]: recording["since"] for recording in atlas.recordings}
    new = max(since.values(), default=-1) + 1
    for checksum, one in result.items():
        one["contents"]["recordings"][0]["since"] = since.get(checksum, new)
    return [result[checksum] for checksum in sorted(result)]


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


def plan(client, progress, url, atlas, mapped, seed, index_keyframes):
    """What the atlas is to hold, with what was mapped: contents, and what is shared by pairs of tiles."""
    ordered = with_published(client, progress, url, atlas, mapped)
    contents = _waymark._append([one["contents"] for one in ordered])
    shared = {(a, b): [a, b, landmarks] for one in ordered for a, b, landmarks in one["shared"]}
    link_all(client, progress, url, contents, shared, seed, index_keyframes)
    contents = _waymark._solve(contents)
    adjust_all(client, progress, url, contents, shared)
    return _waymark._solve(contents), shared


def publish(workspace, atlas, contents, shared):
    """Makes a plan the state of the atlas, with files that are whole: what became of it; None where another program
    has changed the atlas since the plan was made."""
    def is_damaged(name):
        path = atlas.folder / name
        return not path.exists() or checksum_of(path) != path.stem

    names = files_of(contents["tiles"])
    with concurrent.futures.ThreadPoolExecutor() as threads:
        missing = [name for name, damaged in zip(names, threads.map(is_damaged, names)) if damaged]
    if not missing and {"recordings": atlas.recordings, "tiles": atlas.tiles, "links": atlas.links} == contents:
        return "is as it was"
    workspace.need(*missing)
    files = [workspace.folder / name for name in missing]
    return "published" if _waymark._commit(atlas, contents, list(shared.values()), files) else None


def run(recordings, atlas, *, workers=None, scheduler=None, options=(), keyframes=NUM_KEYFRAMES, seed=0, report=None,
        work=None, index_keyframes=INDEX_KEYFRAMES, say=lambda line: None):
    """Maps recordings and makes one atlas of them; what is there already is not done again.

    recordings: paths that each worker can read, of whatever `waymark run` takes, or maps (.wmap).
    atlas: folder of the atlas. Others may write it meanwhile: what they add stays.
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
    started, progress, folder = time.monotonic(), Progress(say), pathlib.Path(atlas)
    atlas = waymark.Atlas(folder)
    url = str(work or (folder / "work").resolve())
    workspace = Workspace(url)
    workspace.remove_abandoned()
    with connected(workers, scheduler, say) as client:
        mapped = map_all(client, progress, url, sorted({str(one) for one in recordings}), list(options), keyframes)
        outcome = None
        while not outcome:
            try:
                contents, shared = plan(client, progress, url, atlas, mapped, seed, index_keyframes)
                outcome = publish(workspace, atlas, contents, shared)
            except waymark.InputError:
                if not _waymark._reload(atlas):  # Else a file may have gone with the state that it was of.
                    raise
            if not outcome:
                say(f"{folder}: was changed by another program meanwhile, so once more")
    say(f"{folder}: {outcome}, {len(contents['tiles'])} tiles of "
        f"{len(contents['recordings'])} recordings, {len(progress.failed)} failed")
    if report:
        write_report(report, progress, contents, time.monotonic() - started)
    return {"contents": contents, "failed": [{"recording": one["recording"], "error": one["error"]}
                                             for one in progress.failed],
            "num_done": sum(done for _, _, done, _ in progress.steps)}


def parse(arguments):
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
    return parser.parse_args(arguments)


def stop(*_):
    """The first Ctrl-C ends it in order, the second one at once."""
    signal.signal(signal.SIGINT, lambda *_: os._exit(130))
    raise KeyboardInterrupt


def main(arguments=None):
    given = parse(arguments)
    logging.disable(logging.CRITICAL)  # Of Dask, which says in many lines what is said below in one.
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, stop)
    options = [word for file in given.config for word in ("-c", str(pathlib.Path(file).resolve()))]
    options += [word for setting in given.set for word in ("--set", setting)]
    options += ["--setup", given.setup] if given.setup else []
    options += ["--seed", str(given.seed)]
    tell = lambda line: print(printable(line), file=sys.stderr, flush=True)
    recordings = {str(pathlib.Path(one).resolve()) for one in given.recordings}
    try:
        result = run(recordings, given.out, workers=given.workers, scheduler=given.scheduler, options=options,
                     keyframes=given.keyframes, seed=given.seed, report=given.report, work=given.work, say=tell)
    except KeyboardInterrupt:
        tell(f"error: {given.out}: stopped, expected to end; run it again and it goes on from where it was")
        return 1
    except waymark.InputError as error:
        tell(f"error: {line_of(error)}")
        return 2
    except Exception as error:  # Of Dask, of a file system, of whatever is between the machines.
        where = "" if isinstance(error, waymark.OutputError) else f"{given.out}: could not finish: "
        tell(f"error: {where}{line_of(error)}")
        return 1
    if not result["failed"]:
        return 0
    if len(result["failed"]) < len(recordings):
        return 3
    tell(f"error: {given.out}: none of the recordings could be mapped, expected one that can")
    return 1


if __name__ == "__main__":
    from waymark import fleet  # Tasks are functions of the module, wherever they run.
    sys.exit(fleet.main())
