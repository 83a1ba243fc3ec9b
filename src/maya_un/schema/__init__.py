"""The messages of the service: only types, which import only other plain values."""
