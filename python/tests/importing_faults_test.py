#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Whatever is wrong with a map of another program is named in one line."""
import math
import random
import sqlite3
import unittest

import waymark
from importing_support import ImportTest, SmallMap, make_database, pack



def put(path, value):
    """Sets what stands under keys, "keyframes.1.ts"."""
    def change(small):
        inside = small.document
        *keys, last = [int(key[1:]) if key.startswith("#") else key for key in path.split(".")]
        for key in keys:
            inside = inside[key]
        inside[last] = value
    return change


DAMAGES = (
    ("keyframes", lambda small: small.document.pop("keyframes")),
    ("no keyframes", put("keyframes", {})),
    ("landmarks: is no MessagePack", put("landmarks", [1])),
    ("landmarks.x", put("landmarks.x", [1])),
    ("has no rot_cw", lambda small: small.keyframe(1).pop("rot_cw")),
    ("rot_cw", put("keyframes.1.rot_cw", [0.0, 0.0, 0.0, 0.5])),
    ("trans_cw: has 2 elements, expected 3", put("keyframes.1.trans_cw", [0.0, 0.0])),
    ("keyframes.1.trans_cw[2]", put("keyframes.1.trans_cw.#2", math.nan)),
    ("pos_w[0]", put("landmarks.3.pos_w.#0", 1e300)),
    ("ts", put("keyframes.1.ts", -1.0)),
    ("undist_keypts[4].oct", put("keyframes.1.undist_keypts.#4.oct", 8)),
    ("undist_keypts[4].oct", put("keyframes.1.undist_keypts.#4.oct", -1)),
    ("undist_keypts[4].pt[1]", put("keyframes.1.undist_keypts.#4.pt.#1", "a")),
    ("undist_keypts[4]", put("keyframes.1.undist_keypts.#4", 7)),
    ("descs", lambda small: small.keyframe(1)["descs"].pop(0)),
    ("descs[2]", lambda small: small.keyframe(1)["descs"][2].append(1)),
    ("descs[2][3]", put("keyframes.1.descs.#2.#3", 1 << 32)),
    ("lm_ids", lambda small: small.keyframe(1)["lm_ids"].append(1)),
    ("depths", put("keyframes.1.depths", [1.0])),
    ("n_keypts", put("keyframes.1.n_keypts", 4_000_000_000)),
    ("cam is 'lost'", put("keyframes.1.cam", "lost")),
    ("orb_params is 'lost'", put("keyframes.1.orb_params", "lost")),
    ("span_parent is 7", put("keyframes.1.span_parent", 7)),
    ("circle", put("keyframes.0.span_parent", 2)),
    ("model 'Square'", put("cameras.cam.model_type", "Square")),
    ("has no fx", lambda small: small.camera().pop("fx")),
    ("cols is", put("cameras.cam.cols", 1e6)),
    ("num_levels", put("orb_params.orb.num_levels", 1000)),
    ("scale_factor", put("orb_params.orb.scale_factor", 1)),
    ("outside the images", put("cameras.cam.cx", 4000.0)),
)
CHANGES = (
    ("no such table: landmarks", "DROP TABLE landmarks"),
    ("expected an SQLite data base", "DROP TABLE keyframes"),
    ("keyframes.1: undist_keypts has 868 bytes, expected 196", "UPDATE keyframes SET n_keypts = 7 WHERE id = 1"),
    ("n_keypts", "UPDATE keyframes SET n_keypts = 1000000000000 WHERE id = 1"),
    ("keyframes.2: pose_cw", "UPDATE keyframes SET pose_cw = zeroblob(128) WHERE id = 2"),
    ("pose_cw has 0 bytes, expected 128", "UPDATE keyframes SET pose_cw = NULL WHERE id = 2"),
    ("cam is 'gone'", "UPDATE keyframes SET cam = 'gone'"),
    ("associations.1: is missing", "DELETE FROM associations WHERE id = 1"),
    ("landmarks.3: pos_w has 1 bytes, expected 24", "UPDATE landmarks SET pos_w = x'00' WHERE id = 3"),
    ("circle", "UPDATE associations SET span_parent = 2 WHERE id = 1; UPDATE associations SET span_parent = 1 WHERE id = 2"),
    ("set-up '3'", "UPDATE cameras SET setup_type = 3"),
    ("defines what would be run, 'view keyframes'", "ALTER TABLE keyframes RENAME TO k; CREATE VIEW keyframes AS SELECT * FROM k"),
    ("'trigger t'", "CREATE TRIGGER t AFTER INSERT ON landmarks BEGIN SELECT 1; END"),
    ("'generated column g'", "ALTER TABLE landmarks ADD COLUMN g AS (id + 1)"),
)


class Faults(ImportTest):
    def test_messagepack(self):
        for words, damage in DAMAGES:
            with self.subTest(words):
                small = SmallMap()
                damage(small)
                self.assert_raises(waymark.InputError, ("map.msg: ", words), self.load, small)

    def test_data_base(self):
        for words, change in CHANGES:
            with self.subTest(words):
                make_database(self.db, SmallMap().document)
                base = sqlite3.connect(self.db)
                base.executescript(change)
                base.close()
                self.assert_raises(waymark.InputError, ("map.db: ", words), waymark.import_map, self.db)

    def assert_sound_or_refused(self, path, data):
        """Whether it was read."""
        path.write_bytes(data)
        try:
            loaded, _ = waymark.import_map(path)
        except waymark.InputError as error:
            self.assertNotIn("\n", str(error))
            return False
        loaded.save(self.folder / "map.wmap")
        waymark.Map.load(self.folder / "map.wmap")
        return True

    def test_truncation_and_flipped_bytes(self):
        whole = pack(SmallMap().document)
        for size in range(0, len(whole), 970):
            self.assertFalse(self.assert_sound_or_refused(self.msg, whole[:size]))
        self.assertFalse(self.assert_sound_or_refused(self.msg, whole + b"x"))
        make_database(self.db, SmallMap().document)
        rng, num_read = random.Random(5), 0
        for path, data in ((self.msg, whole), (self.db, self.db.read_bytes())):
            for i in range(150):
                damaged = bytearray(data[:rng.randrange(16, len(data))] if path == self.db and i % 4 == 0 else data)
                for _ in range(1 + i % 5):
                    damaged[rng.randrange(16, len(damaged))] ^= 1 + rng.randrange(255)
                num_read += self.assert_sound_or_refused(path, bytes(damaged))
        self.assertGreater(num_read, 0)

    def test_bombs(self):
        """Claims of much that is not there, and depth without end."""
        for data in (b"\xdf\xff\xff\xff\xff", b"\x81\xa9keyframes\xdf\xff\xff\xff\xff", b"\x81\xa1x" + b"\x91" * 5_000_000,
                     b"\x81\xa9keyframes\x81\xa10" + b"\x91" * 5_000_000, b"\x81\xa9keyframes\x81\xa10\x81\xa2ts\xdd\xff\xff\xff\xff",
                     b"\x81\xa9keyframes\x81\xa10" + b"\xdd\x00\x01\x80\x00" * 100_000, b"\x81\xdb\xff\xff\xff\xff", b"\xc1"):
            self.assertFalse(self.assert_sound_or_refused(self.msg, data))


if __name__ == "__main__":
    unittest.main()
