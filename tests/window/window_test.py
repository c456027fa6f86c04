#!/usr/bin/env python3
"""Tests of packtrace view in a real window: Xvfb, OpenGL by Mesa in software, xdotool for keys and mouse.

Usage: window_test.py PROGRAM SOURCE_FOLDER WITH_WINDOW [unittest options]
Ends with code 77, which ctest shows as skipped, if the program has no window (WITH_WINDOW is 0), or Xvfb or xdotool is
not installed.
"""

import os
import shutil
import sys
import unittest

import file_cases
import key_cases
import start_cases
import view_cases
from window_case import WindowTest


def load_tests(loader, _tests, _pattern):
    """All cases, for unittest."""
    modules = (start_cases, key_cases, view_cases, file_cases)
    return unittest.TestSuite(loader.loadTestsFromModule(module) for module in modules)


def main():
    program, WindowTest.sources, with_window = sys.argv[1:4]
    WindowTest.program = os.path.abspath(program)
    if with_window == "0":
        print("packtrace was built without its window (.ci/install_packages.sh window)")
        return 77
    for tool in ("Xvfb", "xdotool"):
        if shutil.which(tool) is None:
            print(f"{tool} is not installed (.ci/install_packages.sh tests)")
            return 77
    result = unittest.main(argv=[sys.argv[0], *sys.argv[4:]], exit=False, verbosity=2).result
    return 0 if result.wasSuccessful() and result.testsRun > 0 else 1


if __name__ == "__main__":
    sys.exit(main())
