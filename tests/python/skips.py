"""A plugin of pytest: adds each skipped test to the list of tests/run, and fails it if CI is set."""

import os

import pytest

_LIST = "BENCH_DRAGON_SKIPPED"


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item, call):
    """Handles a test that was skipped, by a mark or during its run."""
    return _noted((yield))


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(collector):
    """Handles a file that was skipped as a whole."""
    return _noted((yield))


def _noted(report):
    # An expected failure is reported as skipped, too.
    if report.skipped and not hasattr(report, "wasxfail"):
        reason = report.longrepr[2].removeprefix("Skipped: ")
        if path := os.environ.get(_LIST):
            with open(path, "a", encoding="utf-8") as skipped:
                skipped.write(f"{report.nodeid}: {reason}\n")
        if os.environ.get("CI"):
            report.outcome, report.longrepr = "failed", f"skipped, and CI is set: {reason}"
    return report
