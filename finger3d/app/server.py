"""Server of the page on the loopback interface, which refuses requests without its token."""

from __future__ import annotations

import logging
import secrets
from dataclasses import dataclass
from typing import TYPE_CHECKING

from flask import Flask, Response, abort, make_response, redirect, request
from werkzeug.serving import BaseWSGIServer, make_server

from finger3d.errors import Finger3dError

if TYPE_CHECKING:
    from dash import Dash

HOST = "127.0.0.1"
_COOKIE = "finger3d_token"


@dataclass(frozen=True)
class LocalServer:
    """A server that waits for requests once `serve` is called.

    Attributes
    ----------
    url : of the page, with its token
    """

    url: str
    _server: BaseWSGIServer

    def serve(self) -> None:
        """Answer requests until the process is interrupted or `stop` is called from another thread."""
        self._server.serve_forever()

    def stop(self) -> None:
        """End `serve`."""
        self._server.shutdown()


def local_server(page: Dash, port: int = 0) -> LocalServer:
    """Return a server of a page on 127.0.0.1.

    Parameters
    ----------
    port : 0 chooses a free one

    Raises
    ------
    Finger3dError
        If the port is taken.
    """
    logging.getLogger("werkzeug").setLevel(logging.ERROR)  # it would print every request, one of them with the token
    token = secrets.token_urlsafe(24)
    protect(page.server, token)
    try:
        server = make_server(HOST, port, page.server, threaded=True)
    except (OSError, SystemExit):
        raise Finger3dError(f"app: port {port} is not free; name another with --port, or none") from None
    return LocalServer(f"http://{HOST}:{server.port}/?token={token}", server)


def protect(application: Flask, token: str) -> None:
    """Refuse requests without the token, and requests for another host name (DNS rebinding).

    The address of the first request holds the token; a cookie holds it afterwards.
    """

    @application.before_request
    def check() -> Response | None:
        if request.host.partition(":")[0] != HOST:
            abort(403)
        given = request.args.get("token", "")
        if secrets.compare_digest(given, token):
            answer = make_response(redirect(request.path))
            answer.set_cookie(_COOKIE, token, httponly=True, samesite="Strict")
            return answer
        if not secrets.compare_digest(request.cookies.get(_COOKIE, ""), token):
            abort(403)
        return None
