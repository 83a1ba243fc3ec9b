"""Nodes of the real machine."""
