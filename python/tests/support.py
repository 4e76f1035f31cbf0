# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""What the tests of the Python module share. They run on what prepare.py made, by ctest."""
import os
import pathlib
import tempfile
import unittest

import waymark

DATA = pathlib.Path(os.environ["WAYMARK_PYTHON_TEST"])
assert str(DATA / "installed") in waymark.__file__, "tests are for the installed module"


def camchain(name="stereo"):
    return DATA / name / "camchain.yaml"


def frames(name="stereo"):
    return list(waymark.open_input(DATA / name, cameras=camchain(name)))


def map_stereo(**options):
    """A finished system of the stereo sequence, fed from arrays."""
    with waymark.System(camchain(), **options) as system:
        for frame in frames():
            system.feed(frame.timestamp_ns, frame.image0, frame.image1)
    return system


class Test(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="waymark_test_")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def assert_raises(self, error, words, function, *arguments, **options):
        """An exception of just this type, whose message is one line with these words."""
        with self.assertRaises(error) as caught:
            function(*arguments, **options)
        self.assertIs(type(caught.exception), error)
        message = str(caught.exception)
        self.assertNotIn("\n", message)
        self.assertNotIn("\0", message)
        for word in [words] if isinstance(words, str) else words:
            self.assertIn(word, message)
