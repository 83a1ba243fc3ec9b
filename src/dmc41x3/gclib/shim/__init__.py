"""A directory with a module named `gclib`: on Python's path it is what `import gclib` finds."""
