"""A Realtime Database for tests: REST, server-sent events and the websocket protocol of Firebase's own libraries.

Written from the public description of the protocol and judged by those libraries (test_rtdb_sdks.py). It keeps one tree
in memory, listens on loopback, and fails when a test asks for it: see `server.py`.
"""
