"""The local server answers only at the secret address of its page."""

from __future__ import annotations

import threading
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from dash import Dash, html

from finger3d.app.server import HOST, LocalServer, local_server
from finger3d.errors import Finger3dError


def page_at(prefix: str) -> Dash:
    page = Dash(__name__, url_base_pathname=prefix)
    page.layout = html.Div("here")
    return page


@contextmanager
def served(prefix: str) -> Iterator[LocalServer]:
    server = local_server(page_at(prefix))
    thread = threading.Thread(target=server.serve)
    thread.start()
    yield server
    server.stop()
    thread.join()


@pytest.fixture
def running() -> Iterator[LocalServer]:
    with served("/secret/") as server:
        yield server


def status(url: str, **headers: str) -> int:
    try:
        with urllib.request.urlopen(urllib.request.Request(url, headers=headers), timeout=10) as answer:
            assert "Set-Cookie" not in answer.headers
            return answer.status
    except urllib.error.HTTPError as error:
        return error.code


def test_only_the_secret_address_is_answered(running: LocalServer) -> None:
    base = running.url.removesuffix("secret/")
    assert base.startswith(f"http://{HOST}:")
    assert status(running.url) == 200
    for path in ("", "guess/", "_dash-layout", "guess/_dash-layout", "%C3%BC/", "%ff/", "?token=%C3%BC"):
        assert status(base + path) == 404, path
    assert status(running.url + "_dash-layout", Cookie="token=\xfc") == 200


def test_a_name_that_another_site_had_resolved_to_this_machine_is_refused(running: LocalServer) -> None:
    assert status(running.url, Host="evil.example:8000") == 403


def test_two_pages_are_open_at_once(running: LocalServer) -> None:
    with served("/other/") as other:
        assert (status(running.url), status(other.url), status(running.url)) == (200, 200, 200)


def test_a_port_that_is_taken_is_refused_by_number(running: LocalServer) -> None:
    port = int(running.url.split(":")[2].split("/")[0])
    with pytest.raises(Finger3dError, match=str(port)):
        local_server(page_at("/secret/"), port)


@pytest.mark.parametrize("port", [-1, 65536, 99999, 10**9])
def test_a_port_that_cannot_be_one_is_refused(port: int) -> None:
    with pytest.raises(Finger3dError, match=f"port {port}: must be"):
        local_server(page_at("/secret/"), port)
