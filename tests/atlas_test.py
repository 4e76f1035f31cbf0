#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Maps cut into tiles, put together again, and images found in them."""
import pathlib
import sqlite3
import subprocess
import sys
import unittest

from cli_support import NUM_FRAMES, PROGRAM, CliTest, waymark

WRITERS = pathlib.Path(__file__).resolve().parents[1] / "benchmarks/atlas_writers.py"


class Atlas(CliTest):
    def path(self, name):
        return self.folder / f"{name}.wmap"

    def make_map(self, name, source, *arguments):
        done = waymark("run", source, *arguments, "-o", self.folder / "run", "--map-out", self.path(name))
        self.assertEqual(done.returncode, 0, done.stderr)

    def task(self, *arguments):
        done = waymark(*arguments)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def rows(self, atlas, columns, table):
        base = sqlite3.connect(f"file:{atlas / 'atlas.db'}?mode=ro", uri=True)
        rows = base.execute(f"SELECT {columns} FROM {table}").fetchall()
        base.close()
        return rows

    def test_halves_become_one(self):
        source = self.sequence("stereo")
        self.make_map("a", source, "--frames", 26, "--keep-images")
        self.make_map("b", source, "--first", 14)
        atlas, other = self.folder / "atlas", self.folder / "other"
        self.assertIn("2 maps added", self.task("atlas", "add", atlas, self.path("a"), self.path("b"), "--keyframes", 8))
        self.assertIn("sound", self.task("atlas", "check", atlas))
        self.assertIn("1 connected part\n", self.task("atlas", "info", atlas))
        self.task("atlas", "add", other, self.path("b"), self.path("a"), "--keyframes", 8)
        for table in ("tile", "link", "shared"):
            self.assertEqual(self.rows(atlas, "*", table), self.rows(other, "*", table))
        self.assertIn("0 maps added", self.task("atlas", "add", atlas, self.path("a")))

        self.task("atlas", "optimize", atlas)
        self.assertIn("sound", self.task("atlas", "check", atlas))
        self.task("atlas", "export", atlas, "-o", self.path("whole"))
        self.assertIn("sound", self.task("map", "check", self.path("whole")))
        for order in ((), ("--unordered",)):
            done = waymark("localize", atlas, source, *order, "-o", self.out)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(self.summary()["localized"], NUM_FRAMES)
            done = waymark("eval", self.out / "trajectory.txt", source / "groundtruth.txt", "--json")
            self.assertEqual(done.returncode, 0, done.stderr)

    def test_one_map_in_tiles(self):
        self.make_map("a", self.sequence("mono"))
        atlas = self.folder / "atlas"
        said = self.task("map", "tile", self.path("a"), "-o", atlas, "--keyframes", 8)
        self.assertRegex(said, r": \d+ tiles?\n")
        state = (atlas / "atlas.db").read_bytes()
        self.assertEqual(self.task("map", "tile", self.path("a"), "-o", atlas, "--keyframes", 8), said)
        self.assertEqual((atlas / "atlas.db").read_bytes(), state)
        self.task("atlas", "export", atlas, "-o", self.path("whole"))
        self.make_map("b", self.sequence("stereo"))
        self.assert_fails(waymark("map", "tile", self.path("b"), "-o", atlas), 2, "another map")
        # What is in metres gives its scale to what is not.
        self.assertIn("1 of 1 pairs", self.task("atlas", "add", atlas, self.path("b")))
        self.assertIn("1 connected part\n", self.task("atlas", "info", atlas))
        self.task("atlas", "export", atlas, "-o", self.path("both"))
        self.assertIn("in metres", self.task("map", "info", self.path("both")))

    def test_many_writers(self):
        """Some are killed; all of one new atlas are heard."""
        source = self.sequence("stereo")
        for name, first in (("a", 0), ("b", 12), ("c", 24)):
            self.make_map(name, source, "--first", first, "--frames", 14)
        maps = [self.path(name) for name in "abc"]
        done = subprocess.run([sys.executable, "-B", WRITERS, *maps, "--program", PROGRAM, "--rounds", "4"],
                              capture_output=True, text=True, timeout=300)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        atlas = self.folder / "new"
        adding = [subprocess.Popen([PROGRAM, "atlas", "add", atlas, path], stderr=subprocess.PIPE, text=True) for path in maps]
        for one in adding:
            message = one.communicate()[1]
            self.assertEqual(one.returncode, 0, message)
        self.assertEqual(len(self.rows(atlas, "checksum", "recording")), 3)
        self.assertIn("sound", self.task("atlas", "check", atlas))

    def test_damaged_tiles_are_noticed(self):
        self.make_map("a", self.sequence("mono"))
        atlas = self.folder / "atlas"
        arguments = ("map", "tile", self.path("a"), "-o", atlas)
        self.task(*arguments)
        state = self.rows(atlas, "*", "tile")
        for damage in (lambda tile: tile.unlink(), lambda tile: tile.write_bytes(tile.read_bytes()[:-100])):
            for command in (arguments, ("atlas", "add", atlas, self.path("a"))):
                for pattern in ("*.wmap", "*.places"):
                    damage(next((atlas / "tiles").glob(pattern)))
                self.task(*command)
                self.assertIn("sound", self.task("atlas", "check", atlas))
        self.assertEqual(self.rows(atlas, "*", "tile"), state)

    def test_wrong_input(self):
        self.assert_fails(waymark("atlas", "info", self.folder), 2, "atlas.db")
        self.assert_fails(waymark("atlas", "add", self.folder / "atlas", self.path("no")), 2, "no.wmap")
        (self.folder / "file").write_text("x")
        self.assert_fails(waymark("atlas", "add", self.folder, self.folder / "file"), 2, "no atlas")
        self.make_map("a", self.sequence("mono"))
        atlas = self.folder / "tiled"
        self.task("map", "tile", self.path("a"), "-o", atlas)
        tile = next((atlas / "tiles").glob("*.wmap"))
        whole = tile.read_bytes()
        tile.write_bytes(whole[:-100])
        self.assert_fails(waymark("atlas", "check", atlas), 2, "faults")
        self.assert_fails(waymark("atlas", "export", atlas, "-o", self.path("out")), 2, tile.name)
        self.assertFalse(self.path("out").exists())
        tile.write_bytes(whole)
        base = sqlite3.connect(atlas / "atlas.db")
        base.execute("UPDATE tile SET scale = 0.0")
        base.commit()
        base.close()
        self.assert_fails(waymark("atlas", "info", atlas), 2, "atlas.db")


if __name__ == "__main__":
    unittest.main()
