"""Nodes of the virtual twin."""
