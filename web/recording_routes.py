"""HTTP routes for recordings: start, stop, and download. All need a user with the role operator."""

from __future__ import annotations

from starlette.requests import Request
from starlette.responses import FileResponse, Response
from starlette.routing import Route

from pneuforce.web.browser_feed import BrowserFeed
from pneuforce.web.login.login import Logins
from pneuforce.web.page_recorder import PageRecorder, RecordingRejected
from pneuforce.web.server.http_json import HttpRequestError, json_response

REPLAY = "A replay cannot be recorded. Copy the file of the recording that is replayed."


class RecordingRoutes:
    """Request handlers for the recordings of the web page."""

    def __init__(self, recorder: PageRecorder, logins: Logins, feed: BrowserFeed) -> None:
        self._recorder, self._logins, self._feed = recorder, logins, feed

    def routes(self) -> list[Route]:
        """Return the routes of the request handlers."""
        handlers = {"start": self.start, "stop": self.stop}
        posts = [Route(f"/api/recording/{name}", each, methods=["POST"]) for name, each in handlers.items()]
        return [*posts, Route("/api/recordings/{file}", self.download)]

    async def start(self, request: Request) -> Response:
        """Start a recording."""
        self._logins.authorize(request)
        if self._feed.header.get("replay"):
            raise HttpRequestError(409, REPLAY)
        try:
            await self._recorder.start()
        except RecordingRejected as error:
            raise HttpRequestError(409, str(error)) from None
        return json_response({})

    async def stop(self, request: Request) -> Response:
        """End the recording."""
        self._logins.authorize(request)
        try:
            await self._recorder.stop()
        except RecordingRejected as error:
            raise HttpRequestError(409, str(error)) from None
        return json_response({})

    async def download(self, request: Request) -> Response:
        """Send a finished recording."""
        self._logins.authorize(request)
        file = self._recorder.finished_file(request.path_params["file"])
        if file is None:
            raise HttpRequestError(404, "This recording does not exist, or it is still in progress.")
        return FileResponse(file, filename=file.name, media_type="application/vnd.sqlite3")
