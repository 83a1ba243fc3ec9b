"""Limits for one client of the endpoint, so that it does not slow down the others."""

from __future__ import annotations

LONGEST_MESSAGE = 1_000_000
"""Longest message of a client, also after joining fragments or unpacking a picture [bytes]."""

LONGEST_SPLIT = 65_536
"""Longest text that is searched for several objects, or for a part of one [characters]."""

CLIENTS = 128
"""Largest number of clients."""

AT_ONCE = 10
"""Largest number of messages of all clients together that are carried out in one turn of the loop."""

LONGEST_TURN = 0.005
"""No further message is started in a turn that has already taken this time [s]."""

READ_AT_ONCE = 16_384
"""Largest amount that is read from a client in one turn [bytes]."""

TOPICS = 200
"""Largest number of topics to which a client may subscribe, and on which it may publish."""

REQUESTS = 100
"""Largest number of subscriptions of one client to one topic."""

SERVED = 100
"""Largest number of services, and of actions, that a client may serve."""

UNDER_WAY = 100
"""Largest number of calls, and of goals, of one client that may be under way."""

WAITING = 100
"""Largest number of messages of a topic that wait for a slow client without `queue_length`; the newest ones."""

LONGEST_QUEUE = 1_000
"""Largest `queue_length`; a greater one is reduced to this."""

OWED = 4_000_000
"""Largest size of topic messages that wait for a client [bytes]; then the oldest of the fullest topic is dropped."""

ANSWERS_OWED = 2_000_000
"""A client that does not read answers is disconnected when more than this waits for it [bytes]."""

SMALLEST_FRAGMENT = 16
"""Smallest size of fragments [characters]; smaller ones are refused."""

GATHERED = 10
"""Largest number of incomplete messages of a client."""

MOST_FRAGMENTS = 10_000
"""Largest number of fragments of a message."""

FRAGMENT_PATIENCE = 60.0
"""An incomplete message is dropped when none of its fragments has come for this time [s]."""

NESTED = 4
"""Largest number of times that a message may be wrapped (fragments of a picture of a fragment ...)."""
