"""Every method of the client as a plan: its requests to the service, in order, and its result."""
