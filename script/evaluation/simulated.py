# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Simulated sequences, made once for each simulator."""
import hashlib
import shutil
import sys

from .program import PROGRAM, ROOT, run


def simulator_version():
    """Changes whenever what the simulator makes may change."""
    folders = [ROOT / "src/waymark" / name for name in ("simulate", "camera", "geometry")]
    sources = sorted(p for folder in folders for p in folder.iterdir()
                     if p.suffix in (".h", ".cc") and not p.stem.endswith("_test"))
    return hashlib.sha256(b"".join(p.read_bytes() for p in sources)).hexdigest()


def simulate(folder, *arguments):
    """Fills the folder with what `waymark simulate` makes of the arguments, unless it is there."""
    recipe = " ".join([simulator_version(), *map(str, arguments)])
    complete = folder / ".complete"
    if not complete.exists() or complete.read_text() != recipe:
        shutil.rmtree(folder, ignore_errors=True)
        print(f"simulating {folder.name}", file=sys.stderr)
        run([PROGRAM, "simulate", *arguments, "-o", folder, "--quiet"])
        complete.write_text(recipe)
    return folder


def suite():
    """(name, set-up) of each sequence of the suite; their motions and seeds are fixed in the library."""
    words = [line.split() for line in run([PROGRAM, "simulate", "--list"]).split("\n")]
    return [tuple(w[1:3]) for w in words if w and w[0] == "sequence"]
