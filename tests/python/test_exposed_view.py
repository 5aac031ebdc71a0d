"""A view that other machines can reach. The test runs in its own network namespace with the address 10.77.0.1."""

import json
import os
import re
from concurrent.futures import ThreadPoolExecutor

import pytest
from view import viewing

ADDRESS = "10.77.0.1"


@pytest.fixture(scope="module", params=[f"{ADDRESS}:0", "0.0.0.0:0"])
def view(request):
    program, instance = os.environ["BENCH_DRAGON"], os.environ["BENCH_DRAGON_INSTANCE"]
    with viewing(program, instance, "--allow-host", "booth.example", listen=request.param) as view:
        view.address = view.address.replace("0.0.0.0", ADDRESS)
        yield view


def test_without_the_token_only_the_empty_page_is_served(view):
    assert view.request("/")[0] == 200
    access = json.loads(view.request("/access")[1])
    assert (access["may_view"], access["may_control"], access["instance"]) == (False, False, "")
    assert view.stream_status() == 401
    assert view.stream_status("bench-dragon.token.00000000000000000000000000000000") == 401
    assert view.request("/metrics")[0] == 401


def test_the_token_allows_viewing_and_commands(view):
    assert view.stream_status(f"bench-dragon.token.{view.token}") == 101
    bearer = {"Authorization": f"Bearer {view.token}"}
    access = json.loads(view.request("/access", **bearer)[1])
    assert access["may_view"] and access["may_control"]
    assert view.command({"command": "pause"})[0] == 200
    assert view.request("/metrics", **bearer)[0] == 200


def test_the_view_accepts_its_addresses_and_the_allowed_names_as_host(view):
    for host in (view.address, "booth.example", "BOOTH.example:80", "localhost"):
        assert view.request("/", Host=host)[0] == 200, host
    for host in ("evil.example", "booth.example.evil.example", "booth"):
        assert view.request("/", Host=host)[0] == 403, host


def test_guesses_of_the_token_are_slowed_and_reported_and_the_operator_elsewhere_gets_in(tmp_path):
    program, instance = os.environ["BENCH_DRAGON"], os.environ["BENCH_DRAGON_INSTANCE"]
    log = tmp_path / "log"
    with log.open("w") as stderr, viewing(program, instance, listen="0.0.0.0:0", stderr=stderr) as view:
        here = view.address.replace("0.0.0.0", "127.0.0.1")
        view.address = view.address.replace("0.0.0.0", ADDRESS)

        def guess(number):
            return view.request("/access", X_Bench_Dragon_Token=f"{number:032x}")[0]

        with ThreadPoolExecutor(40) as pool:
            statuses = list(pool.map(guess, range(40)))
        assert statuses.count(200) >= 20 and 429 in statuses
        assert set(statuses) == {200, 429}
        view.address = here
        assert json.loads(view.request("/access", X_Bench_Dragon_Token=view.token)[1])["may_control"]
    assert re.search(rf"1 wrong token from {ADDRESS}", log.read_text())
