"""Connects the layers: `controller` alone, or the whole `stack`; `staff` provides their worker processes."""
