"""The interface of Galil's own Python module `gclib`, so that scripts written for it run on any controller or twin.

Only the names, arguments and meanings come from gclib, as Galil's public headers and manual pages describe them.
`dmc gclib` installs a module of that name into an environment, or runs a script with it.
"""
