# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Maps in SQLite (.db) of stella_vslam. Blobs are memory of the machine that wrote them, little-endian as good as always."""
import contextlib
import os
import sqlite3
import urllib.parse

import numpy as np

from waymark import _waymark
from waymark.importing_cameras import NUMBERS, Camera, fail, quoted
from waymark.importing_records import MAX_FEATURES, MAX_ID, MAX_LENGTH, MAX_LEVELS, MAX_SECONDS, NO_ID, Keyframe, Landmark, Records

MAX_VALUE_BYTES = 1 << 26
KEYPOINT = np.dtype([("pixel", "<f4", 2), ("size", "<f4"), ("angle", "<f4"), ("response", "<f4"), ("octave", "<i4"), ("class", "<i4")])
STEPS_OF_OPENING = 50_000  # What it takes to look at thousands of definitions; those that programs write have ten or so.
STEPS_OF_ANY, STEPS_PER_BYTE = 10_000_000, 100  # A row takes ten steps or so and has more bytes than that.
DEFINITIONS = (
    "SELECT iif(type = 'table', 'virtual table', type) || ' ' || name FROM sqlite_master "
    "WHERE type NOT IN ('table', 'index') OR (type = 'table' AND rootpage = 0)",
    "SELECT 'generated column ' || c.name FROM sqlite_master s, pragma_table_xinfo(s.name) c WHERE s.type = 'table' AND c.hidden > 0")


class Row:
    def __init__(self, where, names, values):
        self.where, self.values = where, dict(zip(names, values))

    def fail(self, key, what):
        fail(self.where, f"{key} {what}")

    def number(self, key, low=-MAX_LENGTH, high=MAX_LENGTH, whole=False):
        value = self.values[key] or 0
        if not isinstance(value, int if whole else (int, float)) or not low <= value <= high:
            shown = f"{value:g}" if isinstance(value, float) else value if isinstance(value, int) else "no number"
            self.fail(key, f"is {shown}, expected {'an integer' if whole else 'a number'} from {low:.10g} to {high:.10g}")
        return value

    def id(self, key):
        value = self.number(key, -2**63, NO_ID, whole=True)
        if MAX_ID < value < NO_ID:
            self.fail(key, "is beyond all ids")
        return -1 if value == NO_ID else max(value, -1)

    def bytes(self, key):
        value = self.values[key]
        return value if isinstance(value, bytes) else b"" if value is None else str(value).encode()

    def text(self, key):
        return self.bytes(key).rstrip(b"\0").decode(errors="surrogateescape")

    def array(self, key, kind, count=None):
        """The values of a blob; count: how many there have to be."""
        data, size = self.bytes(key), np.dtype(kind).itemsize
        if len(data) % size or count not in (None, len(data) // size):
            self.fail(key, f"has {len(data)} bytes, expected {size * count if count is not None else f'{size} each'}")
        values = np.frombuffer(data, kind)
        if values.dtype.kind == "f" and not (np.abs(values) <= MAX_LENGTH).all():
            self.fail(key, "holds a number beyond bounds")
        return values


class DataBase:
    """One of somebody else's (sqlite.org/security.html): nothing that it defines is run, no value is longer than its file, and
    work ends after so many steps as its size accounts for."""

    def __init__(self, path, name):
        self.name, self.bytes_left = name, os.path.getsize(path)
        uri = "file://" + urllib.parse.quote(os.fsencode(os.path.abspath(path)))
        for access in ("mode=ro", "mode=ro&immutable=1"):  # The latter where a journal that was left behind cannot be used.
            self.steps_left = STEPS_OF_OPENING
            with contextlib.suppress(sqlite3.Error):
                self.base = sqlite3.connect(f"{uri}?{access}", uri=True)
                self._prepare()
                break
        else:
            fail(name, "cannot be read as a map, expected an SQLite data base of stella_vslam with the tables cameras, keyframes, "
                 "landmarks, associations")
        for query in DEFINITIONS:
            try:
                found = self.base.execute(query).fetchone()
            except sqlite3.Error:
                found = (b"what cannot be read",)
            if found:
                fail(name, f"defines what would be run, {quoted(os.fsdecode(found[0]))}, expected an SQLite data base of plain tables")
        reading = (sqlite3.SQLITE_SELECT, sqlite3.SQLITE_READ)
        self.base.set_authorizer(lambda action, *_: sqlite3.SQLITE_OK if action in reading else sqlite3.SQLITE_DENY)
        self.steps_left = STEPS_OF_ANY + STEPS_PER_BYTE * self.bytes_left

    def _prepare(self):
        self.base.text_factory = bytes
        self.base.set_progress_handler(self._count_down, 1000)
        if hasattr(self.base, "setlimit"):  # From Python 3.11 on.
            for limit, value in (("LENGTH", min(MAX_VALUE_BYTES, self.bytes_left)), ("SQL_LENGTH", 100_000), ("COLUMN", 100),
                                 ("EXPR_DEPTH", 10), ("COMPOUND_SELECT", 3), ("VDBE_OP", 25_000), ("FUNCTION_ARG", 8), ("ATTACHED", 0),
                                 ("LIKE_PATTERN_LENGTH", 50), ("TRIGGER_DEPTH", 1)):
                self.base.setlimit(getattr(sqlite3, f"SQLITE_LIMIT_{limit}"), value)
        for pragma in ("trusted_schema=OFF", "query_only=ON", "cell_size_check=ON"):
            self.base.execute(f"PRAGMA {pragma}")
        self.base.execute("SELECT 1 FROM keyframes LIMIT 0")

    def _count_down(self):
        self.steps_left -= 1000
        return self.steps_left < 0

    def rows(self, table, columns):
        """In the order of their ids: in a damaged file pages may refer to each other in a circle. Together values have no more
        bytes than the file, unless rows share pages."""
        names = ("id", *columns.split(", "))
        last = None
        try:
            for values in self.base.execute(f"SELECT id, {columns} FROM {table} NOT INDEXED"):
                if not isinstance(values[0], int) or (last is not None and values[0] <= last):
                    raise sqlite3.DatabaseError("ids do not ascend")
                last = values[0]
                self.bytes_left -= sum(len(value) for value in values if isinstance(value, bytes))
                if self.bytes_left < 0:
                    fail(self.name, "holds more than its size, expected a map")
                yield Row(f"{self.name}: {table}.{last}", names, values)
        except sqlite3.Error as error:
            fail(self.name, f"{table}: {error}, expected a map of stella_vslam")


def keyframe_of_row(row, where, pyramid):
    count = row.number("n_keypts", 0, MAX_FEATURES, whole=True)
    pose = row.array("pose_cw", "<f8", 16).reshape(4, 4).T
    rigid = _waymark._rigid(pose.ravel(), where, "pose_cw")
    points = row.array("undist_keypts", KEYPOINT, count)
    is_sound = ((np.abs(points["pixel"]) <= MAX_LENGTH).all(axis=1) & (np.abs(points["angle"]) <= 1e6) & (points["octave"] >= 0) &
                (points["octave"] < MAX_LEVELS))
    if not is_sound.all():
        row.fail(f"undist_keypts[{np.argmin(is_sound)}]", "is no key point")
    right_columns, depths = (row.array(key, "<f4", count if row.bytes(key) else None) for key in ("x_rights", "depths"))
    return Keyframe(where, row.number("ts", 0, MAX_SECONDS), row.text("cam"), pyramid, rigid[:4], rigid[4:], points["pixel"],
                    points["angle"].astype(float), points["octave"], right_columns, depths,
                    row.array("descs", "u1", 32 * count).reshape(-1, 32), None, -1, ())


def read(path, name, pyramid):
    """The Records of a file. pyramid: that of all keyframes, which is not stored there. InputError as for the other format."""
    records, base = Records(), DataBase(path, name)
    with contextlib.closing(base.base):
        for row in base.rows("cameras", "name, setup_type, model_type, " + ", ".join(NUMBERS)):
            camera = row.text("name")
            if camera in records.cameras:
                row.fail("name", "is there twice, expected once")
            numbers = {key: row.number(key) for key in NUMBERS if row.values[key] is not None}
            records.cameras[camera] = Camera(f"{name}: camera {quoted(camera)}", row.text("model_type"), row.text("setup_type"), numbers)
        for row in base.rows("keyframes", "ts, cam, pose_cw, n_keypts, undist_keypts, x_rights, depths, descs"):
            if row.id("id") < 0:
                row.fail("id", "is negative, expected the id of a keyframe")
            records.keyframes[row.id("id")] = keyframe_of_row(row, row.where, pyramid)
        for row in base.rows("associations", "lm_ids, span_parent, loop_edges"):
            keyframe = records.keyframes.get(row.id("id"))
            if keyframe is not None:
                keyframe.landmarks = row.array("lm_ids", "<i4", len(keyframe.pixels)).astype(np.int64)
                keyframe.parent = row.id("span_parent")
                keyframe.loop_edges = row.array("loop_edges", "<i4")
        for number, keyframe in records.keyframes.items():
            if keyframe.landmarks is None:
                fail(f"{name}: associations.{number}", "is missing, expected what the keyframe sees")
        for row in base.rows("landmarks", "pos_w, ref_keyfrm, n_vis, n_fnd"):
            if row.id("id") < 0:
                row.fail("id", "is negative, expected the id of a landmark")
            counts = [row.number(key, 0, 2**32 - 1, whole=True) for key in ("n_vis", "n_fnd")]
            records.landmarks[row.id("id")] = Landmark(row.array("pos_w", "<f8", 3).tolist(), row.id("ref_keyfrm"), *counts)
    return records


def is_database(path):
    with open(path, "rb") as file:
        return file.read(16) == b"SQLite format 3\0"
