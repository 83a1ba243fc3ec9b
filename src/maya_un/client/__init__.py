"""A running Maya from Python, over HTTP and websocket."""
