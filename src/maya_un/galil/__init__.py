"""The language and the wire of a Galil DMC-41x3; knows nothing of Maya.

`codes`, `numbers`, `commands`, `framing` and `record` do no I/O and serve both roles, host and controller.
`transport` and `driver` carry them in an asyncio loop; `emergency` stops the axes by a plain socket when nothing
else answers. Names are imported from the modules, so that `emergency` loads in milliseconds.
"""
