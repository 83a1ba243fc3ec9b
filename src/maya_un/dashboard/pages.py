"""The routes of the dashboard: its pages, and the files that they load.

Each file is read when it is first requested, and kept in memory: as it is, as the brotli file beside it, and by gzip
for browsers that take no brotli, such as those without TLS on another computer. All names are known at the start, so
an unknown path stays a problem of the HTTP interface.
"""

from __future__ import annotations

import asyncio
import gzip
import hashlib
from pathlib import Path
from typing import NamedTuple
from urllib.parse import urlsplit

from fastapi import FastAPI
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from maya_un.http.origins import LOOPBACK

SITE = Path(__file__).parent / "site"
"""The built pages."""

PAGES = ("/", "/drive", "/queue", "/teach", "/history", "/workshop", "/robots", "/people")
"""Paths of the pages; all of them are answered by the same document (web/src/routes.ts)."""

ASSETS = "assets"
"""The folder of files whose names change with their content."""

_TYPES = {
    ".css": "text/css; charset=utf-8",
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".png": "image/png",
    ".svg": "image/svg+xml",
    ".webmanifest": "application/manifest+json",
    ".woff2": "font/woff2",
}
BROTLI = ".br"
"""Ending of the compressed file beside a file."""

_OPENER = "Cross-Origin-Opener-Policy"
"""A header that browsers only accept from trustworthy origins; from others they report it as an error."""

_FOREVER = "public, max-age=31536000, immutable"


class PageFile(NamedTuple):
    """A file of the dashboard: its content by coding ("" as it is), the smallest last; its type, and its tag."""

    codings: dict[str, bytes]
    media: str
    tag: str


def page_file(path: Path) -> PageFile:
    """Return a file, compressed once; this takes some 10 ms for a large one."""
    content = path.read_bytes()
    codings = {"": content}
    brotli = path.with_name(path.name + BROTLI)
    if brotli.exists():
        codings |= {"gzip": gzip.compress(content, 9, mtime=0), "br": brotli.read_bytes()}
    return PageFile(codings, _TYPES[path.suffix], hashlib.sha256(content).hexdigest()[:16])


def page_headers(camera: str = "") -> dict[str, str]:
    """Return the headers of a page: it may load files of this server and pictures of `camera` (a URL), nothing else.

    No page may show it in a frame, and it sends no address to other sites.
    """
    parts = urlsplit(camera)
    pictures = f" {parts.scheme}://{parts.netloc}" if parts.scheme in {"http", "https"} and parts.netloc else ""
    policy = {
        "default-src": "'none'",
        "script-src": "'self'",
        "style-src": "'self'",
        "img-src": f"'self' data: blob:{pictures}",
        "font-src": "'self'",
        "connect-src": "'self'",
        "manifest-src": "'self'",
        "worker-src": "'self'",
        "base-uri": "'none'",
        "form-action": "'none'",
        "frame-ancestors": "'none'",
    }
    return {
        "Content-Security-Policy": "; ".join(f"{name} {value}" for name, value in policy.items()),
        _OPENER: "same-origin",
        "Permissions-Policy": "camera=(), geolocation=(), microphone=()",
        "Referrer-Policy": "no-referrer",
        "X-Frame-Options": "DENY",
    }


def add_dashboard(app: FastAPI, camera: str = "") -> None:
    """Add the pages of the dashboard to the application; `camera` is the URL of the camera's pictures, "" for none."""
    headers = page_headers(camera)
    document = _Served(SITE / "index.html", {"Cache-Control": "no-cache", **headers})
    for path in PAGES:
        app.router.routes.append(Route(path, document.answer, methods=["GET"]))
    for file in sorted(SITE.rglob("*")):
        name = file.relative_to(SITE).as_posix()
        if file.is_file() and name != "index.html" and file.suffix != BROTLI:
            kept = _FOREVER if name.startswith(f"{ASSETS}/") else "no-cache"
            app.router.routes.append(Route(f"/{name}", _Served(file, {"Cache-Control": kept}).answer, methods=["GET"]))


def _trustworthy(request: Request) -> bool:
    """Return whether a browser trusts the origin of a request: by TLS, or because it is on this computer."""
    return request.url.scheme == "https" or request.url.hostname in LOOPBACK


def _accepted(request: Request) -> set[str]:
    """Return the codings that a client accepts (RFC 9110, 12.5.3); one with the weight 0 is refused."""
    found = {""}
    for part in request.headers.get("accept-encoding", "").split(","):
        name, _, weight = part.replace(" ", "").lower().partition(";q=")
        if weight.strip("0.") or not weight:
            found.add(name)
    return found


class _Served:
    """Answers requests for one file."""

    def __init__(self, path: Path, headers: dict[str, str]) -> None:
        self._path = path
        self._headers = headers
        self._file: PageFile | None = None

    async def answer(self, request: Request) -> Response:
        """Return the file, or 304 if the client has it."""
        if self._file is None:
            self._file = await asyncio.to_thread(page_file, self._path)
        file = self._file
        accepted = _accepted(request)
        coding = next(one for one in reversed(file.codings) if one in accepted)
        tag = f'"{file.tag}{coding and "-"}{coding}"'
        headers = {**self._headers, "ETag": tag, "Vary": "Accept-Encoding"}
        if not _trustworthy(request):
            headers.pop(_OPENER, None)
        if request.headers.get("if-none-match") == tag:
            return Response(status_code=304, headers=headers)
        if coding:
            headers["Content-Encoding"] = coding
        return Response(file.codings[coding], headers=headers, media_type=file.media)
