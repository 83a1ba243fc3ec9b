"""Measures Maya beside what a user would pick instead: `scripts/bench --peers`.

Both do the same work in one run, and a figure counts only if both give the same answer. Peers are imported by name,
because only `.venv-peers` has them.
"""
