# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""waymark.fleet, with the program that was built; where it cannot be imported, WHY_NOT says so."""
import os
import pathlib

try:
    from waymark import fleet
    WHY_NOT = ""
except ImportError as missing:
    fleet, WHY_NOT = None, str(missing)

PROGRAM = pathlib.Path(os.environ["WAYMARK_BUILD"]) / "waymark"
os.environ["WAYMARK_PROGRAM"] = str(PROGRAM)
