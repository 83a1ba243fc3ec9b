"""HTTP and the websocket: they translate between requests and the service, and decide nothing."""
