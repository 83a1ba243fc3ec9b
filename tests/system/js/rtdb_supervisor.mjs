// A supervisor with Firebase's library: it commands the robot NAME, each step after the result of the last, and says
// what it reads as JSON: node rtdb_supervisor.mjs PORT NAME STEP... (a step is JSON; with a key "key" it is set there)
import { initializeApp } from "@firebase/app";
import { child, connectDatabaseEmulator, getDatabase, onValue, push, ref, remove, set } from "@firebase/database";

const [port, name, ...steps] = process.argv.slice(2);
const tell = (what, value) => console.log(JSON.stringify({ [what]: value ?? null }));

const db = getDatabase(initializeApp({ databaseURL: `http://127.0.0.1:${port}?ns=demo` }));
connectDatabaseEmulator(db, "127.0.0.1", Number(port));
const robot = ref(db, `robots/${name}`);

const value = (path, wanted) =>
  new Promise((done) => {
    const off = onValue(child(robot, path), (found) => {
      if (!wanted(found.val())) return;
      setTimeout(() => off());
      done(found.val());
    });
  });

tell("presence", (await value("presence", (found) => found?.state === "ONLINE")).state);
const results = [];
for (const text of steps) {
  const { key, ...step } = JSON.parse(text);
  const at = key ? child(child(robot, "commands"), key) : push(child(robot, "commands"));
  const states = [];
  const off = onValue(child(robot, `progress/${at.key}`), (found) => found.val() && states.push(found.val().state));
  await set(at, step);
  const result = await value(`results/${at.key}`, (found) => found !== null);
  const open = await value(`commands/${at.key}`, () => true);
  off();
  results.push({ key: at.key, states, open, result });
  await remove(child(robot, `results/${at.key}`));
}
tell("results", results);
tell("done", true);
process.exit(0);
