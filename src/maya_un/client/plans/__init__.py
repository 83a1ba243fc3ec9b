"""Every verb of the client as a plan: what is asked of the service, in which order, and what it comes to."""
