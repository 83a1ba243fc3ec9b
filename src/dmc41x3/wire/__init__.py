"""The connections to a DMC-41x3, as a client uses them.

`framing` splits bytes into commands and answers and `transcript` reads recorded conversations; neither does input or
output. `transport` and `stream` carry bytes in an asyncio loop. `emergency` stops the axes by a plain socket when
nothing else answers; it loads in milliseconds.
"""
