"""Middleware: origin policy, limits, access log, and checks before every request."""
