"""How much one client may ask of the endpoint, so that it costs nobody else anything."""

from __future__ import annotations

LONGEST_MESSAGE = 1_000_000
"""Longest message of a client, put together from fragments or unpacked from a picture too [bytes]."""

LONGEST_SPLIT = 65_536
"""Longest text that is searched for several objects, or for a part of one [characters]."""

CLIENTS = 128
"""So many are served at once."""

AT_ONCE = 10
"""So many messages of all clients together are carried out in one turn of the loop."""

LONGEST_TURN = 0.005
"""No further one is begun in a turn that has taken so long already [s]."""

READ_AT_ONCE = 16_384
"""So much of what a client sends is read in one turn [bytes]."""

TOPICS = 200
"""A client may subscribe to so many topics, and publish on so many."""

REQUESTS = 100
"""So many subscriptions of one client may stand on one topic."""

SERVED = 100
"""A client may serve so many services, and so many actions."""

UNDER_WAY = 100
"""So many calls, and so many goals, of one client may be under way."""

WAITING = 100
"""So many messages of a topic wait for a client that is behind, where it asked for no queue; the newest ones."""

LONGEST_QUEUE = 1_000
"""A longer `queue_length` is taken as this."""

OWED = 4_000_000
"""A client that does not read may be owed so much of topics [bytes]; the oldest of the fullest topic goes first."""

ANSWERS_OWED = 2_000_000
"""A client that does not even read answers is disconnected when it is owed so much of them [bytes]."""

SMALLEST_FRAGMENT = 16
"""Smaller fragments than this are refused [characters]."""

GATHERED = 10
"""So many messages of a client may be incomplete."""

MOST_FRAGMENTS = 10_000
"""A message may come in so many fragments."""

FRAGMENT_PATIENCE = 60.0
"""An incomplete message is forgotten when no fragment of it came for so long [s]."""

NESTED = 4
"""So often may a message be wrapped (fragments of a picture of a fragment ...)."""
