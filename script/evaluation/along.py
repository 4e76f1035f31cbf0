# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""What moves along with the camera, and what moves before one at rest: recordings of both, and all
others, in which nothing may be found. `static_*` are those of a camera at rest: no frame may have a
pose."""
from .program import map_sequence, setups_of
from .tables import table


def cells_of(folder, work, auto_mask):
    try:
        run = map_sequence(folder, work / "along_out", setups_of(folder)[0], "--set",
                           f"view.auto_mask={auto_mask}")
    except RuntimeError as error:
        return [str(error), "", ""]
    summary = run.summary
    return [f"{summary['coverage']:.3f}", str(summary["submaps"]),
            f"{100.0 * summary['moves_along']:.1f} %"]


def along_table(data_dir, work, only=None):
    """Sequences of data_dir, which need no ground truth."""
    rows = []
    for folder in sorted(path.parent for path in data_dir.glob("*/camchain.yaml")):
        if only and folder.name not in only:
            continue
        found, unmasked = (cells_of(folder, work, auto_mask) for auto_mask in ("on", "off"))
        rows.append([folder.name, *found, *unmasked[:2]])
    return ("What moves along with the camera (`static_*`: a camera at rest, which starts no map):\n\n" +
            table(["sequence", "coverage", "parts", "of the image moves along", "coverage if not masked",
                   "parts if not masked"], rows))
