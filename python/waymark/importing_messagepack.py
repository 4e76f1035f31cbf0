# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Maps in MessagePack (.msg): with the keys of stella_vslam, or those of OpenVSLAM of 2019 and 2020.

A file may be made to do harm: no more than one record is in memory at once as the file has it, within bounds."""
import contextlib
import os

import numpy as np

from waymark import _waymark
from waymark.importing_cameras import NUMBERS, Camera, fail, printable, quoted
from waymark.importing_records import MAX_FEATURES, MAX_ID, MAX_LENGTH, MAX_LEVELS, MAX_SECONDS, NO_ID, Keyframe, Landmark, Records

MAX_MAP_BYTES = 4 << 30
MAX_RECORD_BYTES = 1 << 26


def kind_of(value):
    names = {type(None): "nil", bool: "a truth value", int: "an integer", float: "a number", str: "a string", list: "an array",
             dict: "a map"}
    return names.get(type(value), "bytes")


def require(where, record, key):
    if not isinstance(record, dict):
        fail(where, f"is {kind_of(record)}, expected a map")
    return record[key] if key in record else fail(where, f"has no {key}, which is needed")


def complain(where, value, shape, low, high, whole):
    """Names the first value that is not as array() wants it."""
    if not shape:
        if type(value) is not int and (whole or type(value) is not float):
            fail(where, f"is {kind_of(value)}, expected {'an integer' if whole else 'a number'}")
        if not low <= value <= high:
            limits = f"an integer from {low} to {high}" if whole else f"a number between {low:g} and {high:g}"
            fail(where, f"is {value}, expected {limits}")
        return
    if not isinstance(value, list):
        fail(where, f"is {kind_of(value)}, expected an array")
    if shape[0] is None and len(value) > MAX_FEATURES:
        fail(where, f"has {len(value)} elements, expected at most {MAX_FEATURES}")
    if shape[0] is not None and len(value) != shape[0]:
        fail(where, f"has {len(value)} elements, expected {shape[0]}")
    for i, one in enumerate(value):
        complain(f"{where}[{i}]", one, shape[1:], low, high, whole)


def array(where, value, shape=(), low=-MAX_LENGTH, high=MAX_LENGTH, whole=False):
    """Numbers in lists within lists; None in a shape: as many as there are."""
    if shape and value != []:
        with contextlib.suppress(ValueError, OverflowError):  # Lists of several lengths.
            result = np.array(value)
            fits = result.ndim == len(shape) and all(size in (None, found) for size, found in zip(shape, result.shape))
            if (fits and result.dtype.kind in ("iu" if whole else "iuf") and len(result) <= MAX_FEATURES and
                    ((result >= low) & (result <= high)).all()):
                return result
    complain(where, value, shape, low, high, whole)
    return np.array(value, np.int64 if whole else float).reshape(-1, *shape[1:]) if shape else value


def value_of(where, record, key, shape=(), *limits, **options):
    """That of a record; default: where it is not there."""
    if "default" in options:
        default = options.pop("default")
        if isinstance(record, dict) and key not in record:
            return default
    return array(f"{where}.{key}", require(where, record, key), shape, *limits, **options)


def column(where, records, key, shape, *limits, **options):
    """The same value of each of a list of records."""
    try:
        return array(where, [record[key] for record in records], (None, *shape), *limits, **options)
    except (KeyError, TypeError, _waymark.InputError):
        for i, record in enumerate(records):
            value_of(f"{where}[{i}]", record, key, shape, *limits, **options)
        raise


def text_of(where, record, key):
    value = require(where, record, key)
    return value if isinstance(value, str) else fail(f"{where}.{key}", f"is {kind_of(value)}, expected a string")


def id_of(where, value):
    if type(value) is int and MAX_ID < value < NO_ID:
        fail(where, f"is {value}, expected an id up to {MAX_ID}")
    number = array(where, value, (), -2**63, NO_ID, whole=True)
    return -1 if number == NO_ID else max(number, -1)


def ids_of(where, record, key):
    """A list of ids; those that are none are -1."""
    ids = array(f"{where}.{key}", require(where, record, key), (None,), -2**63, NO_ID, whole=True).astype(np.int64)
    ids[(ids < 0) | (ids == NO_ID)] = -1
    if (ids > MAX_ID).any():
        fail(f"{where}.{key}", f"holds {ids.max()}, expected ids up to {MAX_ID}")
    return ids


def pyramid_of(where, record, levels_key):
    scale = float(value_of(where, record, "scale_factor", (), -10.0, 10.0, default=1.2))
    if not scale > 1:
        fail(f"{where}.scale_factor", f"is {scale:g}, expected a factor of more than 1")
    return scale, int(value_of(where, record, levels_key, (), 1, MAX_LEVELS, whole=True, default=8))


def camera_of(name, camera, record):
    where = f"{name}: camera {quoted(camera)}"
    numbers = {key: float(array(f"{where}.{key}", value)) for key, value in record.items()
               if key in NUMBERS and type(value) in (int, float)}
    return Camera(where, text_of(where, record, "model_type"), text_of(where, record, "setup_type"), numbers)


def keyframe_of(where, record):
    count = int(value_of(where, record, "n_keypts", (), 0, MAX_FEATURES, whole=True))
    points = require(where, record, "undist_keypts")
    if not isinstance(points, list):
        fail(f"{where}.undist_keypts", f"is {kind_of(points)}, expected an array")
    of_points = f"{where}.undist_keypts"
    words = value_of(where, record, "descs", (None, 8), 0, 2**32 - 1, whole=True)
    keyframe = Keyframe(
        where=where,
        time_s=float(value_of(where, record, "ts", (), -MAX_SECONDS, MAX_SECONDS)),
        camera=text_of(where, record, "cam"),
        pyramid=text_of(where, record, "orb_params") if "orb_params" in record else pyramid_of(where, record, "n_scale_levels"),
        rotation=value_of(where, record, "rot_cw", (4,)).tolist(),
        translation=value_of(where, record, "trans_cw", (3,)).tolist(),
        pixels=column(of_points, points, "pt", (2,)).astype(np.float32),
        angles_deg=column(of_points, points, "ang", (), -1e6, 1e6).astype(float),
        levels=column(of_points, points, "oct", (), 0, MAX_LEVELS - 1, whole=True),
        right_columns=value_of(where, record, "x_rights", (None,), default=np.zeros(0)).astype(np.float32),
        depths_m=value_of(where, record, "depths", (None,), default=np.zeros(0)).astype(np.float32),
        descriptors=words.astype("<u4").view(np.uint8),
        landmarks=ids_of(where, record, "lm_ids"),
        parent=id_of(f"{where}.span_parent", require(where, record, "span_parent")),
        loop_edges=ids_of(where, record, "loop_edges") if "loop_edges" in record else np.zeros(0, np.int64))
    if keyframe.time_s < 0:
        fail(where, "has a negative ts, expected a time in seconds")
    for key, values in (("undist_keypts", keyframe.pixels), ("descs", keyframe.descriptors), ("lm_ids", keyframe.landmarks),
                        ("x_rights", keyframe.right_columns), ("depths", keyframe.depths_m)):
        if len(values) != count and not (len(values) == 0 and key in ("x_rights", "depths")):
            fail(where, f"has {len(values)} {key}, expected {count} as n_keypts says")
    return keyframe


def landmark_of(where, record):
    counts = [int(value_of(where, record, key, (), 0, 2**32 - 1, whole=True, default=0)) for key in ("n_vis", "n_fnd")]
    return Landmark(value_of(where, record, "pos_w", (3,)).tolist(),
                    id_of(f"{where}.ref_keyfrm", require(where, record, "ref_keyfrm")), *counts)


class MessagePack:
    """One object, taken from a file piece by piece."""

    def __init__(self, file, name):
        try:
            import msgpack
        except ImportError:
            fail("python3", "has no module msgpack, expected the package python3-msgpack")
        self.errors = msgpack
        self.unpacker = msgpack.Unpacker(file, raw=False, unicode_errors="surrogateescape", max_buffer_size=MAX_RECORD_BYTES,
                                         max_array_len=MAX_FEATURES, max_map_len=1000)
        self.name = name

    @contextlib.contextmanager
    def named(self, where):
        try:
            yield
        except _waymark.InputError:
            raise
        except self.errors.OutOfData:
            fail(where, f"truncated: goes on after byte {self.unpacker.tell()}, expected more of it before the end of the file")
        except (ValueError, self.errors.UnpackException, RecursionError, OverflowError) as error:
            fail(where, f"is no MessagePack or beyond all bounds ({str(error) or type(error).__name__}), expected a map of stella_vslam")

    def entries(self, where):
        """(key, what errors call its value) of a map, whose values are to be taken."""
        with self.named(where):
            count = self.unpacker.read_map_header()
        seen = set()
        for _ in range(count):
            with self.named(where):
                key = self.unpacker.unpack()
            if not isinstance(key, str):
                fail(where, f"has a key that is {kind_of(key)}, expected a string")
            inside = f"{where}: {printable(key[:40])}" if where == self.name else f"{where}.{printable(key[:40])}"
            if key in seen:
                fail(inside, "is there twice, expected once")
            seen.add(key)
            yield key, inside

    def take(self, where):
        with self.named(where):
            value = self.unpacker.unpack()
        return value if isinstance(value, dict) else fail(where, f"is {kind_of(value)}, expected a map")


def id_in(where, key):
    if key.isascii() and key.isdigit() and len(key) <= 20 and int(key) <= MAX_ID:
        return int(key)
    return fail(where, f"is the key {quoted(key)}, expected an id from 0 to {MAX_ID}")


def read(path, name):
    """The Records of a file. InputError for whatever is missing, malformed or beyond all bounds."""
    if os.path.getsize(path) > MAX_MAP_BYTES:
        fail(name, f"larger than {MAX_MAP_BYTES >> 20} MB, expected a map (.msg or .db)")
    records = Records()
    tables = {"cameras": (records.cameras, lambda _, key: key, lambda where, key, record: camera_of(name, key, record)),
              "orb_params": (records.pyramids, lambda _, key: key, lambda where, _, record: pyramid_of(where, record, "num_levels")),
              "keyframes": (records.keyframes, id_in, lambda where, _, record: keyframe_of(where, record)),
              "landmarks": (records.landmarks, id_in, lambda where, _, record: landmark_of(where, record))}
    with open(path, "rb") as file:
        reader = MessagePack(file, name)
        missing = set(tables) - {"orb_params"}
        for table, where in reader.entries(name):
            if table not in tables:
                with reader.named(where):
                    reader.unpacker.skip()
                continue
            missing.discard(table)
            rows, key_of, read = tables[table]
            for key, inside in reader.entries(where):
                number = key_of(inside, key)
                if number in rows:
                    fail(inside, "is there twice, expected once")
                rows[number] = read(inside, key, reader.take(inside))
        if missing:
            fail(name, f"has no {min(missing)}, which is needed")
        if reader.unpacker.tell() != os.path.getsize(path):
            fail(name, f"goes on after its end at byte {reader.unpacker.tell()}, expected one MessagePack object")
    return records
