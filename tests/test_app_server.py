"""The local server answers only those who know its token."""

from __future__ import annotations

import threading
import urllib.error
import urllib.request
from collections.abc import Iterator

import pytest
from dash import Dash, html
from flask import Flask

from finger3d.app.server import HOST, LocalServer, local_server, protect
from finger3d.errors import Finger3dError

BASE = f"http://{HOST}:8000"


@pytest.fixture
def application() -> Flask:
    app = Flask(__name__)
    app.add_url_rule("/", view_func=lambda: "page")
    protect(app, "secret")
    return app


def test_a_request_needs_the_token_once_and_its_cookie_then(application: Flask) -> None:
    client = application.test_client()
    assert client.get("/", base_url=BASE).status_code == 403
    assert client.get("/?token=guess", base_url=BASE).status_code == 403
    first = client.get("/?token=secret", base_url=BASE)
    assert (first.status_code, first.headers["Location"]) == (302, "/")
    assert "secret" not in first.headers["Location"]
    assert client.get("/", base_url=BASE).data == b"page"


def test_a_name_that_another_site_had_resolved_to_this_machine_is_refused(application: Flask) -> None:
    assert application.test_client().get("/?token=secret", base_url="http://evil.example:8000").status_code == 403


@pytest.fixture
def running() -> Iterator[LocalServer]:
    page = Dash(__name__)
    page.layout = html.Div("here")
    server = local_server(page)
    thread = threading.Thread(target=server.serve)
    thread.start()
    yield server
    server.stop()
    thread.join()


def test_the_page_is_on_the_loopback_interface_at_a_free_port(running: LocalServer) -> None:
    opener = urllib.request.build_opener(urllib.request.HTTPCookieProcessor())
    assert running.url.startswith(f"http://{HOST}:")
    with opener.open(running.url, timeout=10) as answer:
        assert b"_dash" in answer.read()
    with pytest.raises(urllib.error.HTTPError, match="403"):
        urllib.request.urlopen(running.url.partition("?")[0], timeout=10)


def test_a_port_that_is_taken_is_refused_by_number(running: LocalServer) -> None:
    port = int(running.url.split(":")[2].split("/")[0])
    page = Dash(__name__)
    page.layout = html.Div()
    with pytest.raises(Finger3dError, match=str(port)):
        local_server(page, port)
