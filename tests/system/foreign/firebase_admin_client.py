"""Use a Realtime Database by firebase_admin, with output as JSON: firebase_admin_client.py PORT."""

from __future__ import annotations

import json
import queue
import sys
import threading
import time
from typing import Any

import firebase_admin
from firebase_admin import db


def tell(name: str, value: Any) -> None:
    print(json.dumps({name: value}), flush=True)


def received(events: queue.Queue[db.Event]) -> list[Any]:
    event = events.get(timeout=30.0)
    return [event.event_type, event.path, event.data]


def count(reference: db.Reference) -> None:
    for _ in range(10):
        while True:
            try:
                reference.transaction(lambda old: (old or 0) + 1)
                break
            except db.TransactionAbortedError:
                pass


port = sys.argv[1]
firebase_admin.initialize_app(options={"databaseURL": f"http://127.0.0.1:{port}?ns=demo"})

plain = db.reference("plain")
plain.set({"text": "äöü", "number": 1.5, "yes": True, "list": ["x", "y"]})
tell("set and get", plain.get())
db.reference("/").update({"plain/number": 2, "other/deep": "new", "plain/yes": None})
tell("update", [plain.get(), db.reference("other").get()])
db.reference("other").delete()
tell("remove", db.reference("other").get())
keys = [db.reference("queue").push(value).key for value in (1, 2, 3)]
found = db.reference("queue").get()
tell("push", [list(found.values()), keys == sorted(found)])

parts = db.reference("parts")
parts.set({"a": {"at": 3}, "b": {"at": 1}, "c": {"at": 2}, "d": {"at": "x"}})
tell(
    "queries",
    {
        "last": parts.order_by_child("at").limit_to_last(2).get(),
        "first": parts.order_by_key().limit_to_first(2).get(),
        "equal": parts.order_by_child("at").equal_to(2).get(),
        "between": parts.order_by_child("at").start_at(1).end_at(2).get(),
        "key": parts.order_by_key().start_at("c").get(),
    },
)
tell("shallow", parts.get(shallow=True))

value, tag = plain.get(etag=True)
tell("not changed", plain.get_if_changed(tag)[0])
plain.update({"number": 3})
changed, data, tag2 = plain.get_if_changed(tag)
tell("changed", [changed, data["number"]])
tell("stale", plain.set_if_unchanged(tag, {"lost": True})[0])
tell("fresh", plain.set_if_unchanged(tag2, {"kept": True})[0])

tell("transaction", db.reference("count").transaction(lambda old: (old or 0) + 1))
contended = db.reference("contended")
contended.set(0)
threads = [threading.Thread(target=count, args=(contended,)) for _ in range(2)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
tell("contended", contended.get())

when = db.reference("when")
when.set({".sv": "timestamp"})
tell("timestamp", abs(when.get() / 1000.0 - time.time()) < 60.0)
number = db.reference("number")
number.set(5)
db.reference("/").update({"number": {".sv": {"increment": 2.5}}})
tell("increment", number.get())

long = "long äöü " * 30_000
db.reference("long").set(long)
tell("long", db.reference("long").get() == long)

events: queue.Queue[db.Event] = queue.Queue()
listener = db.reference("heard").listen(events.put)
told = [received(events)]
db.reference("heard/a").set(1)
told.append(received(events))
db.reference("heard").update({"b": 2, "c/d": 3})
told.append(received(events))
db.reference("heard/a").delete()
told.append(received(events))
listener.close()
tell("listen", told)

try:
    db.reference("bad").update({"a/b": 1, "a": 2})
except (ValueError, firebase_admin.exceptions.FirebaseError) as error:
    tell("refused", type(error).__name__)
tell("done", True)
