"""The websocket /v1/stream: states at a chosen rate, and every event in order."""
