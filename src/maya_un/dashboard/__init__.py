"""The dashboard: a web page that uses the public HTTP interface and the stream, and nothing else.

The folder `site` is built from `web/` by `scripts/web`.
"""
