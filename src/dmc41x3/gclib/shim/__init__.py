"""A directory with a module named `gclib`, which `import gclib` finds if it is on Python's path."""
