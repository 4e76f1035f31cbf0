# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Where the tasks of waymark.fleet leave what they make, for themselves and for others."""
import contextlib
import functools
import hashlib
import json
import os
import pathlib
import shutil
import tempfile

import fsspec

import waymark
from waymark import _waymark

VERSION = 2  # Of the tasks: a change of what one does makes a new one.


class Workspace:
    """The folder work/ of an atlas, local or wherever fsspec reaches; what native code reads and writes is local.

    Files are named by what they hold: by its SHA-256, or, what a step gave, by all that it depends on.
    """

    def __init__(self, url):
        try:
            self.files, self.root = fsspec.core.url_to_fs(url)
        except Exception as error:  # Whatever a file system of somebody else's has to say.
            raise waymark.InputError(f"{url}: {line_of(error)}; expected a folder, or a URL that fsspec knows") from None
        protocol = self.files.protocol
        self.is_local = "file" in ((protocol,) if isinstance(protocol, str) else protocol)
        if self.is_local:
            self.folder = pathlib.Path(self.root)
        else:
            name = hashlib.sha256(os.fsencode(f"{url} {os.getpid()}")).hexdigest()[:16]
            self.folder = pathlib.Path(tempfile.gettempdir()) / f"waymark-fleet-{name}"
        for name in ("tiles", "maps", "results"):
            (self.folder / name).mkdir(parents=True, exist_ok=True)

    def remove_abandoned(self):
        """Removes what those who were killed had begun; that of the living stays."""
        for prefix in ("new-", "tiles/new-", "maps/.run-"):
            _waymark._remove_abandoned_scratch(self.folder / prefix)

    def is_whole(self, name):
        """Whether a file is there, and here now, with the bytes that its name says."""
        path = self.folder / name
        try:
            if not self.is_local and not path.exists():
                with self.replacing(path) as temporary:
                    self.files.get_file(f"{self.root}/{name}", str(temporary))
            look = path.stat()
            return checksum_by_look(path, look.st_size, look.st_mtime_ns, look.st_ino) == path.stem
        except FileNotFoundError:
            return False

    def need(self, *names):
        """Sees to it that files are here."""
        for name in names:
            if not self.is_whole(name):
                raise waymark.InputError(f"{self.root}/{name}: missing or damaged, expected what an earlier step made; "
                                         "run it again")

    def give(self, *names):
        """Sees to it that everybody has files that were made here."""
        for name in names:
            if not self.is_local:
                self.files.put_file(str(self.folder / name), f"{self.root}/{name}")

    def take(self, path):
        """Puts the file of a tile from elsewhere among the tiles."""
        name = f"tiles/{path.name}"
        if not self.is_whole(name):
            with self.replacing(self.folder / name) as temporary:
                shutil.copyfile(path, temporary)
            self.need(name)
            self.give(name)

    def read(self, name):
        """A result, or None where there is none, or it is damaged."""
        try:
            stored = json.loads(self.files.cat_file(f"{self.root}/results/{name}.json"))
            return stored["result"] if stored["checksum"] == key_of(stored["result"]) else None
        except (FileNotFoundError, ValueError, TypeError, KeyError):
            return None

    def write(self, name, result):
        data = json.dumps({"checksum": key_of(result), "result": result}).encode()
        if self.is_local:
            path = self.folder / "results" / f"{name}.json"
            path.parent.mkdir(parents=True, exist_ok=True)
            with self.replacing(path) as temporary:
                temporary.write_bytes(data)
        else:
            self.files.pipe_file(f"{self.root}/results/{name}.json", data)
        return result

    def once(self, step, inputs, make, *, files=lambda result: ()):
        """The result of a step, made unless it is there with its files, whole."""
        name = f"{step}/{key_of(step, inputs)}"
        result = self.read(name)
        if result is not None and all(self.is_whole(file) for file in files(result)):
            return result, True
        result = make()
        self.give(*files(result))
        return self.write(name, result), False

    @contextlib.contextmanager
    def replacing(self, path):
        """A temporary file that becomes `path`, of this folder, as a whole."""
        with _waymark._ScratchFolder(self.folder / "new-") as scratch:
            yield scratch / path.name
            os.replace(scratch / path.name, path)


def line_of(error):
    """What is said of an exception, in one line."""
    return " ".join(str(error).split()) or type(error).__name__


def key_of(*inputs):
    """A name made of all that a result depends on."""
    text = json.dumps([VERSION, waymark.__version__, *inputs], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def checksum_of(path):
    total = hashlib.sha256()
    with open(path, "rb") as file:
        while block := file.read(1 << 20):
            total.update(block)
    return total.hexdigest()


@functools.lru_cache(maxsize=1 << 16)
def checksum_by_look(path, *_look):
    """The same; a process does not read again what looks as it did."""
    return checksum_of(path)
