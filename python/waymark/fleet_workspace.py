# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Where the tasks of waymark.fleet leave what they make, for themselves and for others."""
import contextlib
import hashlib
import json
import os
import pathlib
import tempfile

import fsspec

import waymark

VERSION = 1  # Of the tasks: a change of what one does makes a new one.


class Workspace:
    """The folder work/ of an atlas, local or wherever fsspec reaches; what native code reads and writes is local."""

    def __init__(self, url):
        self.files, self.root = fsspec.core.url_to_fs(url)
        protocol = self.files.protocol
        self.is_local = "file" in ((protocol,) if isinstance(protocol, str) else protocol)
        if self.is_local:
            self.folder = pathlib.Path(self.root)
        else:
            name = hashlib.sha256(f"{url} {os.getpid()}".encode()).hexdigest()[:16]
            self.folder = pathlib.Path(tempfile.gettempdir()) / f"waymark-fleet-{name}"
        for name in ("tiles", "maps", "results"):
            (self.folder / name).mkdir(parents=True, exist_ok=True)

    def need(self, *names):
        """Sees to it that files are here."""
        for name in names:
            if not (self.folder / name).exists():
                if self.is_local or not self.files.exists(f"{self.root}/{name}"):
                    raise waymark.InputError(f"{self.root}/{name}: missing, expected what an earlier step made")
                with replacing(self.folder / name) as temporary:
                    self.files.get_file(f"{self.root}/{name}", str(temporary))

    def give(self, *names):
        """Sees to it that everybody has files that were made here."""
        for name in names:
            if not self.is_local and not self.files.exists(f"{self.root}/{name}"):
                self.files.put_file(str(self.folder / name), f"{self.root}/{name}")

    def has(self, name):
        return self.files.exists(f"{self.root}/{name}")

    def read(self, name):
        """A result, or None where there is none, or it is damaged."""
        try:
            return json.loads(self.files.cat_file(f"{self.root}/results/{name}.json"))
        except (FileNotFoundError, ValueError):
            return None

    def write(self, name, result):
        data = json.dumps(result).encode()
        if self.is_local:
            path = self.folder / "results" / f"{name}.json"
            path.parent.mkdir(parents=True, exist_ok=True)
            with replacing(path) as temporary:
                temporary.write_bytes(data)
        else:
            self.files.pipe_file(f"{self.root}/results/{name}.json", data)
        return result

    def once(self, step, inputs, make, *, files=lambda result: ()):
        """The result of a step, made unless it is there with its files."""
        name = f"{step}/{key_of(step, inputs)}"
        result = self.read(name)
        if result is not None and all(self.has(file) for file in files(result)):
            return result, True
        result = make()
        self.give(*files(result))
        return self.write(name, result), False


@contextlib.contextmanager
def replacing(path):
    """A temporary file that becomes `path` as a whole."""
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=".new-")
    os.close(handle)
    try:
        yield pathlib.Path(name)
        os.replace(name, path)
    except BaseException:
        pathlib.Path(name).unlink(missing_ok=True)
        raise


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
