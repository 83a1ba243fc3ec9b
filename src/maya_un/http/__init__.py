"""HTTP and the websocket: they translate between requests and the api's Service, and decide nothing."""
