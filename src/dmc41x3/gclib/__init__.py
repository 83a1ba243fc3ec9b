"""The interface of Galil's own Python module `gclib`, so that scripts written for it run on any controller or twin.

Only names, arguments and meanings are theirs, as the public headers and manual pages describe them. `dmc gclib`
puts a module of that name into an environment, or runs a script with it.
"""
