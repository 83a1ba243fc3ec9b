"""The language and the wire of a Galil DMC-41x3; knows nothing of Maya.

`codes`, `numbers`, `commands`, `framing` and `record` do no I/O and serve both roles, host and controller; `program`,
`arrays` and `burned` do none and serve the host. `transport`, `driver` and `stream` carry them in an asyncio loop;
`emergency` stops the axes by a plain socket when nothing else answers. `gclib` is the interface of Galil's own Python
module, on blocking sockets. Names are imported from the modules, so that `emergency` loads in milliseconds.
"""
