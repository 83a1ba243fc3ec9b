"""HTTP and the websocket: they map requests to the service, and contain no application logic."""
