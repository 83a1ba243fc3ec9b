"""A Galil DMC-41x3: a driver for the controller, and a twin of it that answers as it does.

`language` holds the commands and formats, `wire` the connections, `driver` the controller as a client sees it,
`twin` the virtual controller, `conformance` the table that both are checked by, and `gclib` Galil's library.
"""

from __future__ import annotations

__version__ = "0.2.0"
