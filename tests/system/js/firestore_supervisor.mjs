// A supervisor with Firestore's small library: it commands the robot NAME, each step after the result of the last, and
// says what it reads as JSON: node firestore_supervisor.mjs PORT NAME STEP... (a step is JSON)
import { initializeApp } from "@firebase/app";
import {
  addDoc, collection, connectFirestoreEmulator, deleteDoc, doc, getDoc, getDocs, getFirestore, limit, query, setDoc,
} from "@firebase/firestore/lite";

const [port, name, ...steps] = process.argv.slice(2);
const tell = (what, value) => console.log(JSON.stringify({ [what]: value ?? null }));

const db = getFirestore(initializeApp({ projectId: "demo" }));
connectFirestoreEmulator(db, "127.0.0.1", Number(port));
const robot = doc(db, "robots", name);

const until = async (path, holds) => {
  for (;;) {
    const found = await getDoc(doc(robot, ...path));
    if (found.exists() && holds(found.data())) return found.data();
  }
};

const presence = await until(["state", "presence"], (found) => found.state === "ONLINE");
tell("presence", { state: presence.state, at: typeof presence.at.toMillis() });
const results = [];
for (const text of steps) {
  const added = await addDoc(collection(robot, "commands"), JSON.parse(text));
  const result = await until(["results", added.id], () => true);
  const open = (await getDoc(added)).exists();
  await deleteDoc(doc(robot, "results", added.id));
  results.push({ key: added.id, open, result });
}
tell("results", results);
await setDoc(doc(robot, "notes", "a"), { text: "äöü", number: 1.5, whole: 3, yes: true, list: ["x", null] });
await setDoc(doc(robot, "notes", "b"), { deep: { er: { no: false } } });
const notes = await getDocs(query(collection(robot, "notes"), limit(5)));
tell("notes", notes.docs.map((one) => one.data()));
tell("missing", (await getDoc(doc(robot, "notes", "c"))).exists());
tell("done", true);
process.exit(0);
