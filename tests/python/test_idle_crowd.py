"""A crowd of idle connections: the operator can connect nevertheless, and stays connected."""

import contextlib
import http.client
import json
import os
import socket

import pytest
from view import next_frame, viewing

CROWD = 300
HELD = 2


@pytest.fixture
def view():
    with viewing(os.environ["BENCH_DRAGON"], os.environ["BENCH_DRAGON_INSTANCE"]) as view:
        yield view


def crowd(view, held):
    """Opens connections that send nothing, or the first half of a request, in turn."""
    host, _, port = view.address.rpartition(":")
    for place in range(CROWD):
        connection = held.enter_context(socket.create_connection((host, int(port))))
        if place % 2:
            connection.sendall(f"GET / HTTP/1.1\r\nHost: {view.address}\r\n".encode())


def test_idle_connections_do_not_shut_the_operator_out(view):
    with contextlib.ExitStack() as held:
        crowd(view, held)
        assert view.request("/")[0] == 200
        with view.stream(f"bench-dragon.token.{view.token}") as stream:
            next_frame(stream)
            crowd(view, held)
            status, reply = view.command({"command": "hold"})
            assert status == 200 and json.loads(reply)["accepted"], reply
            while next_frame(stream)[0].state != HELD:
                pass


def test_a_connection_that_has_shown_the_token_keeps_its_place(view):
    host, _, port = view.address.rpartition(":")
    operator = http.client.HTTPConnection(host, int(port))
    headers = {"Authorization": f"Bearer {view.token}"}
    operator.request("GET", "/access", headers=headers)
    assert json.loads(operator.getresponse().read())["may_control"]
    its_socket = operator.sock
    with contextlib.ExitStack() as held:
        crowd(view, held)
        operator.request("GET", "/access", headers=headers)
        assert operator.getresponse().read()
        assert operator.sock is its_socket, "no new connection was needed"
