"""The metrics as the stock Prometheus client reads them, compared with the reports of the show's processes.

Run by the Rust test `metrics::a_stock_client_reads_the_values_that_the_processes_of_a_finished_show_report`, which passes
in the environment the address of the exporter, and the folder with the expected values and scrapes of other shows.
"""

import json
import os
import re
import time
import urllib.request
from pathlib import Path

import pytest
from prometheus_client.parser import text_string_to_metric_families

URL = os.environ["BENCH_DRAGON_METRICS"]
FOLDER = Path(os.environ["BENCH_DRAGON_METRICS_FOLDER"])
EXPECTED = json.loads((FOLDER / "expected.json").read_text())
PROJECT = Path(__file__).parents[2]
TIMEOUT_S = 100


def scrape():
    with urllib.request.urlopen(URL, timeout=TIMEOUT_S) as reply:
        assert reply.headers["Content-Type"] == "text/plain; version=0.0.4"
        return reply.read().decode()


def families(text):
    return {family.name: family for family in text_string_to_metric_families(text)}


def samples(text):
    return {
        (sample.name.removeprefix("bench_dragon_"), *sorted(sample.labels.values())): sample.value
        for family in families(text).values()
        for sample in family.samples
    }


@pytest.fixture(scope="module")
def finished():
    """Waits for the scrape with the last reports of all readers."""
    wanted = {("reader_lost_frames_total", name): lost for name, lost in EXPECTED["lost"].items()}
    wanted |= {("reader_frames_total", name): read for name, read in EXPECTED["read"].items()}
    wanted |= {("recorder_written_bytes_total", name): written for name, written in EXPECTED["bytes"].items()}
    wanted |= {("alerts_total", kind): count for kind, count in EXPECTED["alerts"].items()}
    wanted |= {("tick_lateness_seconds_count",): EXPECTED["ticks"], ("ticks_total",): EXPECTED["ticks"]}
    deadline = time.monotonic() + TIMEOUT_S
    while True:
        text = scrape()
        told = samples(text)
        differences = {key: (told.get(key), value) for key, value in wanted.items() if told.get(key) != value}
        # The latency is counted up to a second after the frames.
        if not differences and told["frame_latency_seconds_count",] == told["observed_frames_total",]:
            return text
        assert time.monotonic() < deadline, differences
        time.sleep(0.05)


def test_counts_equal_the_reports_of_the_processes(finished):
    told = samples(finished)
    assert told["overruns_total",] == EXPECTED["overruns"]
    assert told["tick_duration_seconds_count",] == EXPECTED["ticks"]
    assert told["observed_frames_total",] + told["observed_lost_frames_total",] == EXPECTED["ticks"]
    assert sum(value for key, value in told.items() if key[0] == "alerts_total") == sum(EXPECTED["alerts"].values())
    assert told["show_time_seconds",] == pytest.approx(EXPECTED["show_time"], abs=1e-9)
    assert told["run_info", *sorted([str(EXPECTED["run_id"]), "0.1.0"])] == 1
    assert (told["up",], told["show_state", "ended"], told["show_state", "running"]) == (0, 1, 0)


def test_clearance_is_that_of_the_papers_contact(finished):
    told = samples(finished)
    assert told["least_clearance_meters",] < 0
    assert told["least_clearance_meters",] <= told["clearance_meters",]
    during = samples((FOLDER / "during.prom").read_text())
    assert during["forecast_contact_time_seconds",] == pytest.approx(412.473838, abs=1e-6)
    assert during["show_state", "paused"] == 1
    remaining = during["forecast_contact_time_seconds",] - during["show_time_seconds",]
    assert during["forecast_contact_remaining_seconds",] == pytest.approx(remaining, abs=1e-9)


def test_types_match_the_names(finished):
    for family in families(finished).values():
        assert family.documentation, family.name
        names = {sample.name for sample in family.samples}
        if family.type == "counter":
            assert names == {family.name + "_total"}
        elif family.type == "histogram":
            assert names == {family.name + end for end in ("_bucket", "_count", "_sum")}
        else:
            assert (family.type, names) == ("gauge", {family.name})


def test_histograms_are_cumulative_and_whole(finished):
    histograms = [family for family in families(finished).values() if family.type == "histogram"]
    assert len(histograms) == 3
    for family in histograms:
        buckets = [(float(sample.labels["le"]), sample.value) for sample in family.samples if "le" in sample.labels]
        bounds, counts = zip(*buckets)
        assert list(bounds) == sorted(set(bounds)) and bounds[-1] == float("inf")
        assert list(counts) == sorted(counts)
        whole = {sample.name.rpartition("_")[2]: sample.value for sample in family.samples if "le" not in sample.labels}
        assert counts[-1] == whole["count"] > 0
        assert 0 < whole["sum"]
        least = sum((count - before) * bound for (bound, count), before in zip(zip((0, *bounds), counts), (0, *counts)))
        assert whole["sum"] >= least * (1 - 1 / 32), "nothing is shorter than the bucket that it lies in"


def sample_names(*texts):
    return {sample.name for text in texts for family in families(text).values() for sample in family.samples}


@pytest.fixture
def known(finished):
    """The names of all samples of any of these shows."""
    return sample_names(finished, *(path.read_text() for path in FOLDER.glob("*.prom")))


def expressions(node):
    """Yields all PromQL in a document."""
    if isinstance(node, dict):
        for key, value in node.items():
            if key in ("expr", "query", "definition") and isinstance(value, str):
                yield value
            else:
                yield from expressions(value)
    elif isinstance(node, list):
        for value in node:
            yield from expressions(value)


def used(text):
    return set(re.findall(r"bench_dragon_\w+", text))


def test_the_dashboard_and_the_rules_use_existing_metrics(known):
    dashboard = json.loads((PROJECT / "packaging/grafana-dashboard.json").read_text())
    found = list(expressions(dashboard))
    assert len(found) > 15
    rules = (PROJECT / "packaging/prometheus-rules.yml").read_text()
    for name in used(rules).union(*map(used, found)):
        assert name in known, name


def test_frames_are_missed_in_every_state_before_the_end_of_a_show(finished):
    states = {sample.labels["state"] for sample in families(finished)["bench_dragon_show_state"].samples}
    rules = (PROJECT / "packaging/prometheus-rules.yml").read_text()
    (named,) = re.findall(r'bench_dragon_show_state\{state=~"([^"]+)"\}', rules)
    assert set(named.split("|")) == states - {"finished", "ended"}


def test_every_panel_of_the_dashboard_queries_the_chosen_source():
    dashboard = json.loads((PROJECT / "packaging/grafana-dashboard.json").read_text())
    panels = [panel for panel in dashboard["panels"] if panel["type"] != "row"]
    assert len({panel["id"] for panel in dashboard["panels"]}) == len(dashboard["panels"])
    for panel in panels:
        assert panel["datasource"] == {"type": "prometheus", "uid": "${DS_PROMETHEUS}"}, panel["title"]
        assert panel["targets"] and all("$instance" in target["expr"] for target in panel["targets"]), panel["title"]
    assert [source["name"] for source in dashboard["__inputs"]] == ["DS_PROMETHEUS"]


def test_the_docs_describe_every_metric_and_no_other(known):
    told = used((PROJECT / "docs/reference/metrics.md").read_text())
    families = {re.sub(r"_(bucket|sum|count)$", "", name) for name in known}
    assert told - known == {name for name in families if name not in known}, "histograms are listed by their family's name"
    assert families <= told
