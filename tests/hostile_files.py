# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Files that are made to do harm: small sound ones of each kind, and what may be changed of them, by a seed."""
import bz2
import pathlib
import random
import sqlite3
import struct
import zlib

import cv2
import numpy as np

EXPENSIVE = ("length(hex(randomblob(900000000)))", "printf('%.999999999d', 1)", "zeroblob(900000000)",
             "replace(hex(zeroblob(90000)), '00', hex(zeroblob(90000)))", "1" + "+1" * 3000, "(" * 900 + "1" + ")" * 900)
ENDLESS = "WITH RECURSIVE r(n) AS (SELECT 1 UNION ALL SELECT n + 1 FROM r) SELECT n FROM r"
NUMBERS = (0, 1, -1, 2**31 - 1, -2**31, 2**32 - 1, 2**63 - 1, -2**63, 0x7f, 0x80, 0xffff)
TEXTS = (".nan", ".inf", "-1", "0", "1e308", "1e-308", "99999999999999999999", "''", "[]", "{}", "~", "x" * 5000, "\u202e", "&a [*a]",
         "[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]", "!!binary AAAA", "\x1b[2J")


def change_bytes(rng, data):
    """Bytes flipped, numbers put in, pieces cut, doubled, moved."""
    data = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 4, 16))):
        at, size = rng.randrange(len(data) + 1), rng.choice((1, 2, 4, 8, 100, 5000))
        kind = rng.randrange(7)
        if kind == 0 and data:
            data[at % len(data)] ^= 1 << rng.randrange(8)
        elif kind == 1:
            data[at:at + 8] = struct.pack(rng.choice("<>") + "q", rng.choice(NUMBERS))
        elif kind == 2:
            data[at:at + 4] = struct.pack(rng.choice("<>") + "I", rng.choice(NUMBERS) & 0xffffffff)
        elif kind == 3:
            del data[at:at + size]
        elif kind == 4:
            data[at:at] = data[at:at + size] * rng.choice((1, 3))
        elif kind == 5:
            data[at:at + size] = bytes([rng.randrange(256)]) * min(size, len(data) - at)
        elif rng.random() < 0.3:
            del data[at:]
    return bytes(data)


def change_text(rng, text):
    """A value, a line or a word replaced."""
    lines = text.split("\n")
    for _ in range(rng.choice((1, 1, 2, 5))):
        at = rng.randrange(len(lines))
        kind = rng.randrange(6)
        if kind == 0:
            lines[at] = lines[at].split(":")[0] + ": " + rng.choice(TEXTS)
        elif kind == 1:
            words = lines[at].split(",")
            words[rng.randrange(len(words))] = " " + rng.choice(TEXTS)
            lines[at] = ",".join(words)
        elif kind == 2:
            del lines[at:at + 1]
        elif kind == 3:
            lines.insert(at, rng.choice(lines or [""]))
        elif kind == 4:
            lines[at] = " " * rng.randrange(4) + lines[at].lstrip() + rng.choice(TEXTS)
        else:
            lines.insert(at, rng.choice(TEXTS) + ": " + rng.choice(TEXTS))
        lines = lines or [""]
    return "\n".join(lines)


def png(width, height, depth=8, colour=0, rows=None):
    """With any numbers in its header."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    rows = b"\0" * min((width * depth // 8 + 1) * height, 1 << 22) if rows is None else rows
    header = struct.pack(">IIBBBBB", width & 0xffffffff, height & 0xffffffff, depth, colour, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def textured(width, height, shift=0, dtype=np.uint8, channels=1):
    grey = np.random.default_rng(width * 31 + height).integers(0, 255, (height, width, channels))
    return np.roll(grey, shift, axis=1).astype(dtype).squeeze(axis=2 if channels == 1 else ())


def image_file(rng):
    """Bytes and ending of an image of any size and kind, most of them damaged."""
    side = (1, 2, 5, 15, 16, 17, 40, 64, 200)
    width, height = rng.choice(side), rng.choice(side)
    if rng.random() < 0.15:
        width = rng.choice((20001, 33000, 65501, 76800))
        height = rng.choice((1, 16, 100))
    if rng.random() < 0.2:
        return png(rng.choice((0, 1, width, 2**31 - 1, 2**32 - 1)), rng.choice((0, 1, height, 2**31 - 1)),
                   rng.choice((0, 1, 8, 16, 255)), rng.randrange(8)), ".png"
    ending = rng.choice((".png", ".png", ".jpg", ".bmp", ".tiff", ".webp", ".pgm", ".ppm"))
    dtype = np.uint16 if ending in (".png", ".tiff", ".pgm") and rng.random() < 0.3 else np.uint8
    channels = 3 if ending in (".ppm", ".webp") or rng.random() < 0.3 and ending != ".pgm" else 1
    try:
        is_good, data = cv2.imencode(ending, textured(width, height, 0, dtype, channels))
    except cv2.error:
        is_good = False
    data = data.tobytes() if is_good else png(width, height)
    return (change_bytes(rng, data) if rng.random() < 0.6 else data), ending


def counted(data):
    return struct.pack("<I", len(data)) + data


def ros1_image(i, size, encoding=b"mono8", data=None):
    width, height = size
    data = textured(width, height, i).tobytes() if data is None else data
    return (struct.pack("<III", i, 100, i * 50_000_000) + counted(b"cam") + struct.pack("<II", height, width) +
            counted(encoding) + b"\0" + struct.pack("<I", width) + counted(data))


def ros1_record(fields, data):
    return counted(b"".join(counted(name + b"=" + value) for name, value in fields)) + counted(data)


def ros1_bag(size=(20, 20), count=8, compression=b"bz2", name=b"/cam/image_raw", num_topics=1, bomb=None):
    records = b"".join(
        ros1_record(((b"op", b"\x07"), (b"conn", struct.pack("<I", k)), (b"topic", name + b"%d" % k)),
                    counted(b"topic=" + name) + counted(b"type=sensor_msgs/Image") + counted(b"md5sum=0"))
        for k in range(num_topics))
    for i in range(count):
        records += ros1_record(((b"op", b"\x02"), (b"conn", struct.pack("<I", i % num_topics)), (b"time", struct.pack("<II", 100, i))),
                               ros1_image(i, size))
    chunks = [records] + ([b"\0" * bomb] * 10 if bomb else [])
    packed = {chunk: bz2.compress(chunk) if compression == b"bz2" else chunk for chunk in set(chunks)}
    return b"#ROSBAG V2.0\n" + ros1_record(((b"op", b"\x03"), (b"index_pos", struct.pack("<Q", 4117))), b" " * 100) + b"".join(
        ros1_record(((b"op", b"\x05"), (b"compression", compression), (b"size", struct.pack("<I", len(chunk)))), packed[chunk])
        for chunk in chunks)


def mcap(size=(20, 20), count=8, name=b"/cam/image_raw", num_topics=1):
    def record(opcode, content):
        return bytes([opcode]) + struct.pack("<Q", len(content)) + content
    result = b"\x89MCAP0\r\n" + record(1, counted(b"ros1") + counted(b"test"))
    result += record(3, struct.pack("<H", 1) + counted(b"sensor_msgs/Image") + counted(b"ros1msg") + counted(b""))
    for k in range(num_topics):
        result += record(4, struct.pack("<HH", k % 65536, 1) + counted(name + b"%d" % k) + counted(b"ros1") + counted(b""))
    for i in range(count):
        result += record(5, struct.pack("<HIQQ", i % num_topics % 65536, i, i + 1, i + 1) + ros1_image(i, size))
    return result + record(0x0f, struct.pack("<I", 0)) + record(2, bytes(20)) + b"\x89MCAP0\r\n"


def sqlite_bag(path, num_topics=1, columns="topic_id INTEGER, timestamp INTEGER, data BLOB"):
    base = sqlite3.connect(path)
    base.execute("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT)")
    base.execute(f"CREATE TABLE messages(id INTEGER PRIMARY KEY, {columns})")
    base.executemany("INSERT INTO topics VALUES(?, ?, 'sensor_msgs/msg/Image', 'cdr')",
                     ((k, f"/cam{k}") for k in range(num_topics)))
    for i in range(6):
        image = b"\0\1\0\0" + ros1_image(i, (20, 20))[4:]
        base.execute("INSERT INTO messages(id, topic_id, timestamp, data) VALUES(?, ?, ?, ?)", (i, i % num_topics, i, image))
    base.commit()
    base.close()


def change_base(rng, path):
    """Definitions that would be run, and values of other kinds and sizes."""
    base = sqlite3.connect(path, isolation_level=None)
    base.execute("PRAGMA synchronous=OFF")
    tables = [row[0] for row in base.execute("SELECT name FROM sqlite_schema WHERE type = 'table' AND name NOT LIKE 'sqlite%'")]
    table = rng.choice(tables)
    column = rng.choice([row[1] for row in base.execute(f"PRAGMA table_info({table})")])
    value = rng.choice((*NUMBERS, "''", "'x'", "x'00'", "NULL", "0.5", "9e999", "zeroblob(100000)", "hex(zeroblob(100000))"))
    slow = rng.choice(EXPENSIVE)
    statements = rng.choice((
        f"UPDATE {table} SET {column} = {value}", f"UPDATE {table} SET {column} = {value}", f"DELETE FROM {table}", f"DROP TABLE {table}",
        f"ALTER TABLE {table} ADD COLUMN extra AS ({slow})", f"ALTER TABLE {table} RENAME COLUMN {column} TO other",
        f"ALTER TABLE {table} RENAME TO other; CREATE VIEW {table} AS {ENDLESS}",
        f"ALTER TABLE {table} RENAME TO other; CREATE VIEW {table} AS SELECT *, {slow} AS extra FROM other",
        f"CREATE INDEX extra ON {table} ({column}) WHERE {column} > 0", f"CREATE INDEX extra ON {table} (length({column}))",
        f"CREATE TRIGGER extra AFTER INSERT ON {table} BEGIN SELECT {slow}; END",
        "CREATE VIRTUAL TABLE extra USING fts5(a)", "PRAGMA user_version = 77", "PRAGMA journal_mode = WAL",
        # As no statement would leave it.
        f"PRAGMA writable_schema = ON; UPDATE sqlite_schema SET sql = replace(sql, '{column} ', '{column} AS ({slow}), dummy ') "
        f"WHERE name = '{table}'",
        f"PRAGMA writable_schema = ON; UPDATE sqlite_schema SET rootpage = {rng.randrange(9)} WHERE name = '{table}'",
        f"PRAGMA writable_schema = ON; UPDATE sqlite_schema SET sql = 'CREATE TABLE {table}(a CHECK ({slow}))' WHERE name = '{table}'",
        f"PRAGMA writable_schema = ON; INSERT INTO sqlite_schema SELECT 'table', 'n' || rowid, 'n' || rowid, 2, "
        f"'CREATE TABLE n' || rowid || '(a)' FROM sqlite_schema",
        "".join(f"CREATE TABLE extra{i}(a);" for i in range(300))))
    try:
        base.executescript(statements)
    except sqlite3.Error:
        pass  # What SQLite itself does not let happen.
    base.close()
    if rng.random() < 0.3:
        path = pathlib.Path(path)
        path.write_bytes(change_bytes(rng, path.read_bytes()))
