"""Routes of the HTTP interface: each maps one path to one method of the service."""
