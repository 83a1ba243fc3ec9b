// What Firebase's libraries do at a Realtime Database, said as JSON, a line each: node rtdb.mjs client|admin PORT
import { deleteApp as endApp, initializeApp as startApp } from "@firebase/app";
import * as database from "@firebase/database";
import { deleteApp, initializeApp } from "firebase-admin/app";
import { getDatabase, ServerValue } from "firebase-admin/database";

const [library, port] = process.argv.slice(2);
const tell = (name, value) => console.log(JSON.stringify({ [name]: value ?? null }));
const apps = [];

// One connection: the same few words for both libraries.
const connect = {
  client(name) {
    const app = startApp({ databaseURL: `http://127.0.0.1:${port}?ns=demo` }, name);
    apps.push(() => endApp(app));
    const db = database.getDatabase(app);
    database.connectDatabaseEmulator(db, "127.0.0.1", Number(port));
    const at = (path) => database.ref(db, path);
    const event = { value: database.onValue, child_added: database.onChildAdded, child_removed: database.onChildRemoved };
    const order = { child: database.orderByChild, key: database.orderByKey, value: database.orderByValue };
    return {
      set: (path, value) => database.set(at(path), value),
      get: async (path) => (await database.get(at(path))).val(),
      update: (path, value) => database.update(at(path), value),
      remove: (path) => database.remove(at(path)),
      push: async (path, value) => (await database.push(at(path), value)).key,
      on: (path, kind, heard) => event[kind](at(path), (one) => heard(one.val(), one.key)),
      once: async (path, by, of, limits) => {
        const limited = limits.map(([how, ...what]) => database[how](...what));
        const found = await database.get(database.query(at(path), order[by](...of), ...limited));
        return found.val();
      },
      change: async (path, how) => (await database.runTransaction(at(path), how)).snapshot.val(),
      time: database.serverTimestamp(),
      more: database.increment,
      atEnd: (path) => database.onDisconnect(at(path)),
      end: () => database.goOffline(db),
      again: () => database.goOnline(db),
    };
  },
  admin(name) {
    const app = initializeApp({ databaseURL: `http://127.0.0.1:${port}?ns=demo` }, name);
    apps.push(() => deleteApp(app));
    const db = getDatabase(app);
    const order = { child: "orderByChild", key: "orderByKey", value: "orderByValue" };
    return {
      set: (path, value) => db.ref(path).set(value),
      get: async (path) => (await db.ref(path).get()).val(),
      update: (path, value) => db.ref(path).update(value),
      remove: (path) => db.ref(path).remove(),
      push: async (path, value) => (await db.ref(path).push(value)).key,
      on: (path, kind, heard) => {
        const one = db.ref(path);
        const listener = one.on(kind, (found) => heard(found.val(), found.key));
        return () => one.off(kind, listener);
      },
      once: async (path, by, of, limits) => {
        let query = db.ref(path)[order[by]](...of);
        for (const [how, ...what] of limits) query = query[how](...what);
        return (await query.get()).val();
      },
      change: async (path, how) => (await db.ref(path).transaction(how)).snapshot.val(),
      time: ServerValue.TIMESTAMP,
      more: ServerValue.increment,
      atEnd: (path) => db.ref(path).onDisconnect(),
      end: () => db.goOffline(),
      again: () => db.goOnline(),
    };
  },
}[library];

// The first value of a path for which `wanted` holds.
const until = (one, path, wanted) =>
  new Promise((done) => {
    const off = one.on(path, "value", (value) => {
      if (!wanted(value)) return;
      setTimeout(() => off());
      done(value);
    });
  });

const [a, b] = [connect("a"), connect("b")];

await a.set("plain", { text: "äöü", number: 1.5, yes: true, list: ["x", "y"], none: null });
tell("set and get", await b.get("plain"));
await a.update("/", { "plain/number": 2, "other/deep": "new", "plain/yes": null });
tell("update", [await b.get("plain"), await b.get("other")]);
await a.remove("other");
tell("remove", await b.get("other"));

const added = [];
const removed = [];
const [offAdded, offRemoved] = ["child_added", "child_removed"].map((kind, at) =>
  b.on("queue", kind, (value) => [added, removed][at].push(value)),
);
const keys = [];
for (const value of [1, 2, 3]) keys.push(await a.push("queue", value));
await until(b, "queue", (value) => Object.keys(value ?? {}).length === 3);
await a.remove(`queue/${keys[1]}`);
await until(b, "queue", (value) => Object.keys(value ?? {}).length === 2);
tell("push", [added, removed, [...keys].sort().join() === keys.join()]);
offAdded();
offRemoved();
await a.push("queue", 4);
await b.get("queue");
tell("off", added.length);

const heard = until(b, "shown", (value) => value === "seen");
await a.set("shown", "seen");
tell("on value", await heard);

await a.set("parts", { a: { at: 3 }, b: { at: 1 }, c: { at: 2 }, d: { at: "x" } });
tell("queries", {
  last: await b.once("parts", "child", ["at"], [["limitToLast", 2]]),
  first: await b.once("parts", "key", [], [["limitToFirst", 2]]),
  equal: await b.once("parts", "child", ["at"], [["equalTo", 2]]),
  between: await b.once("parts", "child", ["at"], [["startAt", 1], ["endAt", 2]]),
  key: await b.once("parts", "key", [], [["startAt", "c"]]),
});

tell("transaction", await a.change("count", (old) => (old ?? 0) + 1));
await a.set("contended", 0);
const more = (one) => async () => { for (let turn = 0; turn < 10; turn++) await one.change("contended", (old) => (old ?? 0) + 1); };
await Promise.all([more(a)(), more(b)()]);
tell("contended", await a.get("contended"));
tell("transaction on an object", await a.change("parts/a", (old) => old && { ...old, more: [1.25, "é", false] }));

await a.set("when", a.time);
tell("timestamp", Math.abs((await b.get("when")) - Date.now()) < 60000);
await a.set("number", 5);
await a.update("/", { number: a.more(2.5) });
tell("increment", await b.get("number"));

const long = "long äöü ".repeat(30000);
await a.set("long", { one: long, two: { three: long } });
const back = await b.get("long");
tell("long frames", back.one === long && back.two.three === long);
const long2 = until(b, "long/one", (value) => value?.length === 100001);
await a.set("long/one", "y".repeat(100001));
tell("long event", (await long2).length);

await b.set("presence", { state: "ONLINE" });
await b.atEnd("presence").set({ state: "OFFLINE", at: b.time });
await b.atEnd("never").set(1);
await b.atEnd("never").cancel();
await b.atEnd("/").update({ "gone/deep": true });
b.end();
tell("on disconnect", (await until(a, "presence", (value) => value.state === "OFFLINE")).state);
tell("merged on disconnect", await until(a, "gone", (value) => value !== null));
tell("cancelled on disconnect", await a.get("never"));
const missed = until(b, "missed", (value) => value !== null);
await a.set("missed", "told again");
b.again();
tell("listen again", await missed);

tell("done", true);
for (const end of apps) await end();
process.exit(0);
