"""Access control: roles, the table of operations, callers, users and their tokens, and the gate of the service."""
