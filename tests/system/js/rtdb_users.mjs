// What Firebase's library does where rules hold: node rtdb_users.mjs PORT EMAIL PASSWORD UID
// It says "ready" and waits for a line on standard input where the test changes something at the server.
import { createInterface } from "node:readline/promises";
import { initializeApp } from "@firebase/app";
import { connectAuthEmulator, getAuth, signInWithEmailAndPassword, signOut } from "@firebase/auth";
import { connectDatabaseEmulator, get, getDatabase, onValue, ref, set } from "@firebase/database";

const [port, email, password, uid] = process.argv.slice(2);
const tell = (name, value) => console.log(JSON.stringify({ [name]: value ?? null }));
const lines = createInterface({ input: process.stdin })[Symbol.asyncIterator]();
const tried = (work) => work.then(() => "ok", (error) => error.code ?? error.message);

const app = initializeApp({ apiKey: "key", databaseURL: `http://127.0.0.1:${port}?ns=demo` });
const [auth, db] = [getAuth(app), getDatabase(app)];
connectAuthEmulator(auth, `http://127.0.0.1:${port}`, { disableWarnings: true });
connectDatabaseEmulator(db, "127.0.0.1", Number(port));

tell("nobody writes", await tried(set(ref(db, `users/${uid}/x`), 1)));
tell("nobody reads", (await tried(get(ref(db, `users/${uid}`)))).slice(0, 17));
tell("wrong password", await tried(signInWithEmailAndPassword(auth, email, `${password}x`)));
tell("signs in", (await signInWithEmailAndPassword(auth, email, password)).user.uid);
tell("writes", await tried(set(ref(db, `users/${uid}/x`), 1)));
tell("elsewhere", await tried(set(ref(db, "users/another/x"), 1)));
tell("invalid", await tried(set(ref(db, `users/${uid}/x`), "text")));

const values = [];
let arrived = () => {};
let cancelled = () => {};
const cancel = new Promise((done) => { cancelled = done; });
onValue(ref(db, `users/${uid}/x`), (one) => { values.push(one.val()); arrived(); }, (error) => cancelled(error.code));
const next = () => new Promise((done) => { arrived = done; });
if (values.length === 0) await next();
tell("ready", "listens");
const changed = next();
await lines.next(); // the test ends the token, then changes the value
await changed;
tell("after the token", values.at(-1));
tell("ready", "renewed");
await lines.next(); // the test changes the rules
tell("cancelled", await cancel);
await signOut(auth);
tell("signed out", await tried(set(ref(db, `users/${uid}/x`), 3)));
tell("done", true);
process.exit(0);
