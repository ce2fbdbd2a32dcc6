"""Server of the page on the loopback interface."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import TYPE_CHECKING

from flask import abort, request
from werkzeug.serving import BaseWSGIServer, make_server

from finger3d.errors import Finger3dError

if TYPE_CHECKING:
    from dash import Dash

HOST = "127.0.0.1"


@dataclass(frozen=True)
class LocalServer:
    """A server that waits for requests once `serve` is called.

    Attributes
    ----------
    url : of the page
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

    The address of the page is secret, and requests for another host name (DNS rebinding) are refused. Nothing is kept
    in the browser: cookies of one port would be sent to every other port of this machine.

    Parameters
    ----------
    port : 0 chooses a free one

    Raises
    ------
    Finger3dError
        If the port is taken, or cannot be one.
    """
    if not 0 <= port < 2**16:
        raise Finger3dError(f"app: port {port}: must be from 1 to 65535, or 0 for a free one")
    logging.getLogger("werkzeug").setLevel(logging.ERROR)  # it would print every request, with the secret
    page.server.before_request(_refuse_other_hosts)
    try:
        server = make_server(HOST, port, page.server, threaded=True)
    except (OSError, SystemExit):
        raise Finger3dError(f"app: port {port} is not free; name another with --port, or none") from None
    return LocalServer(f"http://{HOST}:{server.port}{page.config.requests_pathname_prefix}", server)


def _refuse_other_hosts() -> None:
    if request.host.partition(":")[0] != HOST:
        abort(403)
