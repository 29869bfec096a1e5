"""HTTP routes for recordings: start, stop, and download. All need the operator's token."""

from __future__ import annotations

import time

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import FileResponse, Response
from starlette.routing import Route

from pneuforce.web.browser_feed import BrowserFeed
from pneuforce.web.download_links import DownloadLinks
from pneuforce.web.http_json import HttpRequestError, json_response, read_json_object
from pneuforce.web.login import Logins
from pneuforce.web.page_recorder import PageRecorder, RecordingRejected

REPLAY = "A replay cannot be recorded. Copy the file of the recording that is replayed."


class RecordingRoutes:
    """Request handlers for the recordings of the web page."""

    def __init__(self, recorder: PageRecorder, logins: Logins, feed: BrowserFeed) -> None:
        self._recorder, self._logins, self._feed = recorder, logins, feed
        self._links = DownloadLinks()

    def routes(self) -> list[Route]:
        """Return the routes of the request handlers."""
        handlers = {"start": self.start, "stop": self.stop, "link": self.link}
        posts = [Route(f"/api/recording/{name}", each, methods=["POST"]) for name, each in handlers.items()]
        return [*posts, Route("/api/recordings/{key}", self.download)]

    async def start(self, request: Request) -> Response:
        """Start a recording."""
        self._logins.check(await read_json_object(request), request)
        if self._feed.header.get("replay"):
            raise HttpRequestError(409, REPLAY)
        try:
            await self._recorder.start()
        except RecordingRejected as error:
            raise HttpRequestError(409, str(error)) from None
        return self._logins.remember_browser(request, json_response({}))

    async def stop(self, request: Request) -> Response:
        """End the recording."""
        self._logins.check(await read_json_object(request), request)
        try:
            await self._recorder.stop()
        except RecordingRejected as error:
            raise HttpRequestError(409, str(error)) from None
        return self._logins.remember_browser(request, json_response({}))

    async def link(self, request: Request) -> Response:
        """Return a link to a finished recording, which is valid for one minute."""
        body = await read_json_object(request)
        self._logins.check(body, request)
        file = self._recorder.finished_file(body.get("file"))
        if file is None:
            raise HttpRequestError(404, "This recording does not exist, or it is still in progress.")
        key = self._links.create(file, time.monotonic())
        return self._logins.remember_browser(request, json_response({"link": f"/api/recordings/{key}"}))

    async def download(self, request: Request) -> Response:
        """Send the file of a link."""
        file = self._links.file_of(request.path_params["key"], time.monotonic())
        if file is None or not file.is_file():
            raise HTTPException(404)
        return FileResponse(file, filename=file.name, media_type="application/vnd.sqlite3")
