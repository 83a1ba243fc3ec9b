"""The HTTP door on loopback: it translates between requests and the api's Service, and decides nothing."""
