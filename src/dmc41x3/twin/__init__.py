"""A virtual DMC-41x3, the other end of the wire. Its motors drive any plant, such as a bench."""
