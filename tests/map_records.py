# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Takes map files apart into their records, and puts records together again (docs/map-format.md)."""
import struct

from exchange_formats import pack

CRC32C = []
for byte in range(256):
    for _ in range(8):
        byte = (byte >> 1) ^ (0x82F63B78 if byte & 1 else 0)
    CRC32C.append(byte)


def crc32c(data):
    value = 0xFFFFFFFF
    for byte in data:
        value = CRC32C[(value ^ byte) & 0xFF] ^ (value >> 8)
    return value ^ 0xFFFFFFFF


class Unpacker:
    def __init__(self, data):
        self.data, self.at = data, 0

    def take(self, count):
        self.at += count
        return self.data[self.at - count:self.at]

    def whole(self, count):
        return int.from_bytes(self.take(count), "big")

    def items(self, count):
        return [self.value() for _ in range(count)]

    def pairs(self, count):
        return {self.value(): self.value() for _ in range(count)}

    def value(self):
        kind = self.whole(1)
        if kind < 0x80 or kind >= 0xE0:
            return kind if kind < 0x80 else kind - 256
        if kind < 0xA0:
            return self.pairs(kind & 15) if kind < 0x90 else self.items(kind & 15)
        if kind < 0xC0:
            return self.take(kind & 31).decode()
        if kind < 0xC4:
            return [None, None, False, True][kind - 0xC0]
        if kind < 0xC7:
            return self.take(self.whole(1 << (kind - 0xC4)))
        if kind == 0xCB:
            return struct.unpack(">d", self.take(8))[0]
        if kind < 0xD0:
            return self.whole(1 << (kind - 0xCC))
        if kind < 0xD4:
            return int.from_bytes(self.take(1 << (kind - 0xD0)), "big", signed=True)
        if kind < 0xDC:
            return self.take(self.whole(1 << (kind - 0xD9))).decode()
        return self.items(self.whole(2 << (kind - 0xDC))) if kind < 0xDE else self.pairs(
            self.whole(2 << (kind - 0xDE)))


def split(data):
    """The records of a map file in order, without their checksums."""
    unpacker, records = Unpacker(data), []
    while unpacker.at < len(data):
        records.append(unpacker.value())
        del records[-1]["crc32c"]
    return records


def pack_pairs(pairs):
    """A record of these keys and values, also of equal keys, with its checksum."""
    body = b"\xdf" + struct.pack(">I", len(pairs) + 1)
    body += b"".join(pack(key) + pack(value) for key, value in pairs) + pack("crc32c")
    return body + b"\xce" + struct.pack(">I", crc32c(body))


def join(records):
    """The bytes of a file of such records; bytes among them are taken as they are."""
    return b"".join(record if isinstance(record, bytes) else pack_pairs(list(record.items()))
                    for record in records)
