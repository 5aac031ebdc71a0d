"""The package as it is installed: its types, its examples in the documentation, its files."""

import doctest
import importlib.resources
import os
import subprocess
import sys
from pathlib import Path

import bench_dragon
import pytest
from bench_dragon import bench, continuity

PACKAGE = Path(__file__).parents[1]


def test_its_types_are_whole():
    checked = subprocess.run(
        [sys.executable, "-m", "mypy", "--cache-dir", os.devnull, "src", "examples"],
        cwd=PACKAGE,
        capture_output=True,
        text=True,
        check=False,
    )
    assert checked.returncode == 0, checked.stdout + checked.stderr


def test_type_checkers_find_its_types():
    assert importlib.resources.files(bench_dragon).joinpath("py.typed").is_file()


@pytest.mark.parametrize("module", [bench, continuity])
def test_the_examples_in_its_documentation_are_right(module):
    tested = doctest.testmod(module, report=True)
    assert (tested.failed, tested.attempted > 0) == (0, True)


def test_a_status_shows_as_one_line_without_its_histograms():
    shown = repr(bench_dragon.Status(tick=7))
    assert "tick=7" in shown
    assert "counts=[1024 numbers]" in shown
    assert len(shown) < 1000


def test_all_that_it_names_is_there():
    assert [name for name in bench_dragon.__all__ if not getattr(bench_dragon, name).__doc__] == []
