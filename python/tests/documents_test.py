#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""The stubs say what the module has, everything is documented, and examples in docstrings run."""
import ast
import doctest
import inspect
import os
import pathlib
import shutil
import unittest

import waymark
from support import DATA, Test
from waymark import _waymark

STUBS = ast.parse((pathlib.Path(waymark.__file__).parent / "_waymark.pyi").read_text())
SPECIAL = {"__init__", "__iter__", "__next__", "__len__", "__enter__", "__exit__", "_repr_html_"}


def parameters_of_stub(function):
    arguments = function.args
    names = [argument.arg for argument in arguments.args + arguments.kwonlyargs]
    kinds = ["or keyword"] * len(arguments.args) + ["keyword only"] * len(arguments.kwonlyargs)
    defaults = [None] * (len(arguments.args) - len(arguments.defaults)) + arguments.defaults
    defaults += arguments.kw_defaults
    values = [inspect.Parameter.empty if value is None else ast.literal_eval(value)
              for value in defaults]
    return list(zip(names, kinds, values))


def parameters_of(function):
    kinds = {inspect.Parameter.KEYWORD_ONLY: "keyword only",
             inspect.Parameter.POSITIONAL_OR_KEYWORD: "or keyword"}
    return [(p.name, kinds[p.kind], p.default) for p in inspect.signature(function).parameters.values()]


def members(cls):
    return {name: value for name, value in vars(cls).items()
            if name in SPECIAL or not name.startswith("_")}


class Stubs(Test):
    def test_names(self):
        in_stubs = {node.name for node in STUBS.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
        in_stubs |= {node.target.id for node in STUBS.body if isinstance(node, ast.AnnAssign)}
        self.assertEqual(in_stubs, set(waymark.__all__))
        in_module = {name for name in vars(_waymark) if not name.startswith("_")} | {"__version__", "import_map", "import_settings"}
        self.assertEqual(in_stubs, in_module)

    def test_functions(self):
        for node in STUBS.body:
            if isinstance(node, ast.FunctionDef):
                with self.subTest(node.name):
                    self.assertEqual(parameters_of_stub(node), parameters_of(getattr(waymark, node.name)))

    def test_classes(self):
        for node in STUBS.body:
            if not isinstance(node, ast.ClassDef) or node.name.endswith("Error"):
                continue
            actual = members(getattr(waymark, node.name))
            actual.pop("__init__", None)  # Inherited where there is none.
            stubs = {member.name: member for member in node.body}
            with self.subTest(node.name):
                self.assertEqual(set(actual), set(stubs) - {"__init__"})
            for name, stub in stubs.items():
                with self.subTest(f"{node.name}.{name}"):
                    self.check_member(getattr(waymark, node.name), name, stub)

    def check_member(self, cls, name, stub):
        decorators = {decorator.id for decorator in stub.decorator_list}
        if "property" in decorators:
            self.assertIsInstance(vars(cls)[name], property)
        elif name not in SPECIAL - {"__init__"}:
            self.assertEqual(parameters_of_stub(stub), parameters_of(getattr(cls, name)))


class Docstrings(Test):
    def test_everything_has_one(self):
        for name in waymark.__all__:
            value = getattr(waymark, name)
            if not callable(value):
                continue
            self.assertTrue(value.__doc__, name)
            self.assertEqual(value.__module__.split(".")[0], "waymark")
            if inspect.isclass(value):
                for member in set(members(value)) - SPECIAL:
                    self.assertTrue(getattr(value, member).__doc__, f"{name}.{member}")

    def test_examples_run(self):
        shutil.copytree(DATA / "stereo", self.folder / "sequence")
        shutil.copy(DATA / "stereo_out/map.wmap", self.folder / "map.wmap")
        before = os.getcwd()
        self.addCleanup(os.chdir, before)
        os.chdir(self.folder)
        runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS)
        for name in ("__doc__", *waymark.__all__):
            value = waymark if name == "__doc__" else getattr(waymark, name)
            test = doctest.DocTestParser().get_doctest(value.__doc__ or "", {}, name, None, 0)
            runner.run(test)
        self.assertEqual(runner.failures, 0)
        self.assertGreater(runner.tries, 3)


if __name__ == "__main__":
    unittest.main()
