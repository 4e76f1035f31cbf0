# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""A headless client of the viewer's protocol (docs/viewer-protocol.md), of the standard library alone."""
import base64
import json
import os
import socket
import struct
import time
import urllib.parse

KINDS = {1: "begin", 2: "end", 3: "landmarks", 4: "landmark positions", 5: "landmarks erased", 6: "cameras",
         7: "keyframes", 8: "keyframe poses", 9: "keyframes erased", 10: "covisibility", 11: "loops",
         12: "trajectory", 13: "frame", 14: "submaps"}


class Refused(Exception):
    """The server did not open a WebSocket; the text is its status line."""


class ViewerClient:
    """Connects, and keeps what a page would: ids of landmarks, keyframes and frames, the newest status."""

    def __init__(self, url, origin=None, timeout=20.0, path="/ws"):
        self.url = url
        parts = urllib.parse.urlsplit(url)
        self.socket = socket.create_connection((parts.hostname, parts.port), timeout)
        self._buffer = b""
        self._next_request = 1
        self.landmarks, self.keyframes, self.frames = set(), set(), {}
        self.texts, self.kinds = [], []
        self.status = self.hello = None
        self.generation = self.num_frames_shown = 0
        self.is_complete = False
        query = f"?{parts.query}" if parts.query else ""
        key = base64.b64encode(os.urandom(16)).decode()
        lines = [f"GET {path}{query} HTTP/1.1", f"Host: {parts.netloc}", "Upgrade: websocket", "Connection: Upgrade",
                 f"Sec-WebSocket-Key: {key}", "Sec-WebSocket-Version: 13"]
        if origin is not None:
            lines.append(f"Origin: {origin}")
        self.socket.sendall("\r\n".join([*lines, "", ""]).encode())
        header = b""
        while b"\r\n\r\n" not in header:
            byte = self.socket.recv(1)
            if not byte:
                break
            header += byte
        if not header.startswith(b"HTTP/1.1 101"):
            self.socket.close()
            raise Refused(header.split(b"\r\n")[0].decode())

    def close(self):
        self.socket.close()

    def _need(self, size):
        while len(self._buffer) < size:
            data = self.socket.recv(1 << 18)
            if not data:
                raise ConnectionError("the server closed the connection")
            self._buffer += data
        taken, self._buffer = self._buffer[:size], self._buffer[size:]
        return taken

    def send_frame(self, opcode, payload):
        """A masked frame, as clients have to send them."""
        size = len(payload)
        length = bytes([128 | size]) if size < 126 else (
            bytes([128 | 126]) + struct.pack(">H", size) if size < 65536 else
            bytes([128 | 127]) + struct.pack(">Q", size))
        self.socket.sendall(bytes([128 | opcode]) + length + b"\0\0\0\0" + payload)

    def receive(self):
        """Takes one message in; (opcode, payload)."""
        first, second = self._need(2)
        size = second & 127
        if size == 126:
            size, = struct.unpack(">H", self._need(2))
        elif size == 127:
            size, = struct.unpack(">Q", self._need(8))
        opcode, payload = first & 15, self._need(size)
        if opcode == 9:
            self.send_frame(10, payload)
        elif opcode == 8:
            raise ConnectionError("the server said goodbye")
        elif opcode == 1:
            self._take_text(json.loads(payload))
        elif opcode == 2:
            self._take_binary(payload)
        return opcode, payload

    def _take_text(self, message):
        self.texts.append(message)
        if message["type"] == "status":
            self.status = message
        elif message["type"] == "hello":
            self.hello = message

    def _take_binary(self, payload):
        kind, version, _, count = struct.unpack_from("<BBHI", payload)
        assert version == 1, version
        self.kinds.append(KINDS[kind])
        ids = struct.unpack_from(f"<{count}I", payload, 8) if kind in (3, 5, 7, 9, 12) else ()
        if kind == 1:
            self.landmarks, self.keyframes, self.frames = set(), set(), {}
            self.generation, *self.announced = struct.unpack_from("<4I", payload, 8)
            self.is_complete = False
        elif kind == 2:
            self.is_complete = True
        elif kind == 3:
            self.landmarks.update(ids)
        elif kind == 5:
            self.landmarks.difference_update(ids)
        elif kind == 7:
            self.keyframes.update(ids)
        elif kind == 9:
            self.keyframes.difference_update(ids)
        elif kind == 12:
            states = payload[8 + 42 * count:8 + 43 * count]
            self.frames.update(zip(ids, states))
        elif kind == 13:
            self.num_frames_shown += 1

    def wait_for(self, condition, seconds=60.0):
        """Takes messages in until condition(self) holds."""
        end = time.monotonic() + seconds
        while not condition(self):
            if time.monotonic() > end:
                raise TimeoutError(f"the newest status is {self.status}")
            self.receive()

    def holds_what_status_says(self):
        return (self.is_complete and self.status is not None and self.texts[-1] is self.status and
                len(self.landmarks) == self.status["landmarks"] and
                len(self.keyframes) == self.status["keyframes"])

    def request(self, do, **more):
        """Sends a request; its number."""
        number = self._next_request
        self._next_request += 1
        self.send_frame(1, json.dumps({"request": number, "do": do, **more}).encode())
        return number

    def ask(self, do, **more):
        """Sends a request and waits for the answer."""
        number = self.request(do, **more)
        answers = []

        def is_answered(client):
            answers[:] = [t for t in client.texts if t.get("request") == number]
            return bool(answers)
        self.wait_for(is_answered)
        return answers[0]
