# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Markdown."""


def table(header, rows):
    lines = [header, ["---"] + ["---:"] * (len(header) - 1), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def list_of(lines):
    return "\n".join(f"* {line}" for line in lines)
