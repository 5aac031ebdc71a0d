"""The installed package: its types, the examples in its documentation, its files."""

import doctest
import importlib.metadata
import importlib.resources
import os
import subprocess
import sys
from pathlib import Path

import bench_dragon
import pytest
from bench_dragon import bench
from stage import EXAMPLES

PACKAGE = Path(__file__).parents[1]


def test_mypy_finds_no_error_in_strict_mode():
    checked = subprocess.run(
        [sys.executable, "-m", "mypy", "--cache-dir", os.devnull, "src", str(EXAMPLES / "head.py")],
        cwd=PACKAGE,
        capture_output=True,
        text=True,
        check=False,
    )
    assert checked.returncode == 0, checked.stdout + checked.stderr


def test_type_checkers_find_the_marker_of_a_typed_package():
    assert importlib.resources.files(bench_dragon).joinpath("py.typed").is_file()


def test_the_examples_in_the_docstrings_are_correct():
    tested = doctest.testmod(bench, report=True)
    assert (tested.failed, tested.attempted > 0) == (0, True)


def test_the_text_of_a_status_is_short_and_leaves_out_histogram_counts():
    shown = repr(bench_dragon.Status(tick=7))
    assert "tick=7" in shown
    assert "counts=[1024 numbers]" in shown
    assert len(shown) < 1000


def test_the_package_has_its_version():
    assert bench_dragon.__version__ == importlib.metadata.version("bench_dragon")


def test_the_protocol_of_the_timecode_has_a_name():
    protocols = [bench_dragon.Status(timecode_kind=number).timecode_protocol for number in range(5)]
    kind = bench_dragon.TimecodeKind
    assert protocols == [kind.NONE, kind.ART_NET, kind.OSC, kind.LTC, None]


def test_every_public_name_exists_and_has_a_docstring():
    assert [name for name in bench_dragon.__all__ if not getattr(bench_dragon, name).__doc__] == []
