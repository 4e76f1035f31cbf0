#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""waymark.fleet where something is wrong: other writers, damage, names, schedulers, workers, Ctrl-C."""
import contextlib
import os
import shutil
import signal
import subprocess
import sys
import unittest

import waymark
from fleet_support import PROGRAM, WHY_NOT, fleet
from support import DATA, Test

STEREO, RGBD, MONO = (DATA / f"{name}_out/map.wmap" for name in ("stereo", "rgbd", "mono"))
CLUSTER = """
import sys
from distributed import LocalCluster
cluster = LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None)
print(cluster.scheduler_address, flush=True)
sys.stdin.read()
"""


def described(result):
    return {name: result["contents"][name] for name in ("recordings", "tiles", "links")}


@unittest.skipIf(WHY_NOT, WHY_NOT)
class FleetFaults(Test):
    def run_fleet(self, name, *recordings, **options):
        return fleet.run(recordings, self.folder / name, workers=1, keyframes=8, **options)

    def start_program(self, *arguments, **options):
        return subprocess.Popen([PROGRAM, "fleet", *arguments], stderr=subprocess.PIPE, start_new_session=True, **options)

    def assert_ends(self, process, status, *words):
        """With one line of an error, if there is one, and nothing that a terminal obeys."""
        said = process.communicate(timeout=120)[1].decode()
        self.assertEqual(process.returncode, status, said)
        self.assertFalse([c for c in said if c != "\n" and not c.isprintable()], said)
        errors = [line for line in said.splitlines() if line.startswith("error: ")]
        self.assertEqual(len(errors), status in (1, 2), said)
        self.assertNotIn("Traceback", said)
        for word in words:
            self.assertIn(word, said)

    @contextlib.contextmanager
    def cluster(self, **options):
        """The address of a scheduler with one worker, and the process that both end with."""
        with subprocess.Popen([sys.executable, "-c", CLUSTER], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                              stderr=subprocess.DEVNULL, text=True, **options) as process:
            yield process.stdout.readline().strip(), process
            process.stdin.close()

    def test_what_others_add_meanwhile_stays(self):
        atlas = self.folder / "atlas"
        said = []

        def add_meanwhile(line):
            said.append(line)
            if len(said) == 3:
                waymark.Atlas(atlas).add([RGBD], keyframes=8)
            if line.startswith("verify") and len(waymark.Atlas(atlas).recordings) == 1:
                self.run_fleet("atlas", MONO)

        result = self.run_fleet("atlas", STEREO, say=add_meanwhile)
        self.assertIn(f"{atlas}: was changed by another program meanwhile, so once more", said)
        self.assertEqual(len(result["contents"]["recordings"]), 3)
        opened = waymark.Atlas(atlas)
        self.assertEqual(opened.check(), [])
        self.assertEqual(described(result), {"recordings": opened.recordings, "tiles": opened.tiles, "links": opened.links})
        self.assertEqual(self.run_fleet("atlas", STEREO)["num_done"], 0)

    def test_what_is_damaged_is_made_again(self):
        first = self.run_fleet("atlas", STEREO, RGBD)
        atlas = self.folder / "atlas"
        work = atlas / "work"
        tiles = first["contents"]["tiles"]
        self.assertTrue(any(tile["checksum"] != tile["origin"] for tile in tiles))
        (atlas / f"tiles/{tiles[0]['checksum']}.wmap").unlink()
        (atlas / f"tiles/{tiles[1]['places']}.places").write_bytes(b"cut")
        self.assertEqual(self.run_fleet("atlas", STEREO, RGBD)["num_done"], 0)
        self.assertEqual(waymark.Atlas(atlas).check(), [])
        os.truncate(work / f"tiles/{tiles[0]['origin']}.wmap", 100)
        (work / f"tiles/{tiles[1]['places']}.places").unlink()
        (work / f"tiles/{tiles[1]['checksum']}.wmap").unlink()
        next((work / "results/match").iterdir()).write_text("[1]")
        again = self.run_fleet("atlas", STEREO, RGBD)
        self.assertGreaterEqual(again["num_done"], 3)
        self.assertEqual(described(again), described(first))
        # What the atlas has and is not named now is taken from the atlas where the workspace lost it.
        shutil.rmtree(work)
        later = self.run_fleet("atlas", MONO)
        self.assertEqual(len(later["contents"]["recordings"]), 3)
        self.assertEqual(waymark.Atlas(atlas).check(), [])

    def test_names_leftovers_and_modules_of_others(self):
        here = self.folder / "here"
        here.mkdir()
        for name in ("fsspec", "dask", "distributed", "waymark", "json"):
            (here / f"{name}.py").write_text(f"open('was_run', 'a').write('{name}\\n')\nraise SystemExit(77)\n")
        (here / "damaged\x1b[31m").mkdir()
        shutil.copy(os.fsencode(STEREO), os.fsencode(here) + b"/\xff\x1b[2J.wmap")
        atlas = here / "atlas"
        work, maps = atlas / "work", atlas / "work" / "maps"
        for left in (atlas / "tiles/new-abcdef", work / "tiles/new-abcdef", maps / ".run-abcdef/out"):
            left.mkdir(parents=True)
        waymark.Atlas(self.folder / "new")
        shutil.copy(self.folder / "new/atlas.db", atlas)
        (work / "tiles/new-uvwxyz").write_text("of an older program")
        alive = waymark._waymark._ScratchFolder(maps / ".run-")
        names = [b"\xff\x1b[2J.wmap", "damaged\x1b[31m"]
        with alive as kept:
            self.assert_ends(self.start_program(*names, "-o", "atlas", "--workers", "1", "--report", "page.html", cwd=here,
                                                env={**os.environ, "PYTHONPATH": f":{os.environ['PYTHONPATH']}"}),
                             3, "\\x1b[31m", "\\x1b[2J", "1 failed")
            self.assertTrue(kept.exists())
        self.assertFalse((here / "was_run").exists())
        self.assertIn("1 failed", (here / "page.html").read_text(encoding="utf-8"))
        self.assertEqual([path.name for path in here.glob("atlas/**/*new-*")], [])
        self.assertEqual([path.name for path in maps.iterdir()], [])
        self.assert_ends(self.start_program(names[1], "-o", "atlas", "--workers", "1", cwd=here), 1, "none of the recordings")

    def test_what_cannot_work_is_a_line(self):
        atlas = self.folder / "atlas"
        self.assert_ends(self.start_program(STEREO, "-o", atlas, "--work", "foo://x"), 2, "foo://x", "fsspec")
        self.assert_ends(self.start_program(STEREO, "-o", atlas, "--scheduler", "garbage"), 2, "garbage", "tcp://")
        clean = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
        if not waymark.__file__.startswith("/usr/lib"):
            with self.cluster(env=clean, cwd=self.folder) as (address, _):
                self.assert_ends(self.start_program(STEREO, "-o", atlas, "--scheduler", address), 2, "this worker", "PYTHONPATH")
        with self.cluster() as (address, process):
            started = self.start_program(DATA / "stereo", STEREO, "-o", atlas, "--scheduler", address)
            started.stderr.readline()
            process.kill()
            self.assert_ends(started, 1, address, "the scheduler has ended")

    def test_ctrl_c_is_a_line(self):
        started = self.start_program(DATA / "stereo", DATA / "rgbd", "-o", self.folder / "atlas", "--workers", "1")
        self.assertIn(b"[1/2]", started.stderr.readline())
        os.killpg(started.pid, signal.SIGINT)  # As a terminal does.
        self.assert_ends(started, 1, "stopped")
        # Half of a recording does not pass for all of it.
        last_frame = waymark.Map.load(STEREO).keyframes().frames.max()
        for path in (self.folder / "atlas" / "work" / "maps").glob("*.wmap"):
            self.assertGreater(waymark.Map.load(path).keyframes().frames.max(), 0.7 * last_frame)


if __name__ == "__main__":
    unittest.main()
