import { expect, test } from "vitest";
import { bodyAsJob, firstGap, freshName, newestByName, newStep, palletOf, percentOf, readStep, readTarget, renamed, stepOf, stepOfKey, taskOf, tidy, trimmed, withName, withoutName, withoutStep, writeStep, writeTarget, type JobData } from "../src/parts/job.ts";

const JOB: JobData = {
  name: "one cube",
  parts: { cube: [0.5, 1.1] },
  places: { tray: [1.1, 0.5], mat: [1, 0.7] },
  steps: ["home", { pick: "cube" }, { place: "tray" }, { for_each: "box", do: [{ approach: "box[each]" }, { line: "mat" }] }],
};

test.each([
  ["home", { command: "home", argument: true, inner: null }],
  [{ home: null }, { command: "home", argument: true, inner: null }],
  [{ pick: "cube" }, { command: "pick", argument: "cube", inner: null }],
  [{ gripper: "open" }, { command: "gripper", argument: "open", inner: null }],
  [{ for_each: "tray", do: ["home"] }, { command: "for_each", argument: "tray", inner: ["home"] }],
  [{ pick: "cube", speed: 0.5 }, { command: "pick", argument: "cube", inner: null, speed: 0.5 }],
  [{ speed: "50 %", line: "mat" }, { command: "line", argument: "mat", inner: null, speed: "50 %" }],
  [{ wait: 2 }, { command: "wait", argument: 2, inner: null }],
  [{ shake: 3 }, { command: "shake", argument: 3, inner: null }],
  [7, { command: "", argument: 7, inner: null }],
])("reads the step %j", (step, parts) => {
  expect(readStep(step)).toEqual(parts);
});

test("writes every step as it was read", () => {
  for (const step of JOB.steps) {
    const { command, argument, inner } = readStep(step);
    expect(writeStep(command, argument, inner)).toEqual(step);
  }
});

test.each([{ wait: 2 }, { set: { output: "vacuum", to: "on" } }, { wait_for: { input: 3, is: "off", within: 10 } }, { ask: "Ready?" }, { pick: "cube", speed: 0.25 }])("writes the step %j as it was read", (step) => {
  const { command, argument, inner, speed } = readStep(step);
  expect(writeStep(command, argument, inner, speed)).toEqual(step);
});

test.each([[0.5, 50], ["50 %", 50], ["0.25", 25], [undefined, null], ["fast", null]])("reads the speed %j as %j percent", (speed, percent) => {
  expect(percentOf(speed)).toBe(percent);
});

test("a new statement is not complete until its channel or question is chosen", () => {
  expect(firstGap({ steps: [newStep(JOB, "wait")] })).toBeNull();
  for (const command of ["set", "wait_for", "ask"]) expect(firstGap({ steps: [newStep(JOB, command)] })).toEqual({ step: 0, inner: null });
  expect(firstGap({ steps: [{ set: { output: 3, to: "on" } }] })).toBeNull();
});

test("an if keeps both branches, and is not complete without a step in then", () => {
  const step = { if: { answer: "yes" }, then: [{ pick: "cube" }], else: [{ wait: 1 }, { if: { input: 1, is: "on" }, then: ["home"] }] };
  const { command, argument, inner, speed, otherwise } = readStep(step);
  expect(writeStep(command, argument, inner, speed, otherwise)).toEqual(step);
  expect(renamed({ ...JOB, steps: [step] }, "parts", "cube", "box").steps).toEqual([{ ...step, then: [{ pick: "box" }] }]);
  expect(bodyAsJob({ steps: [{ ...step, then: [{ home: true }] }] }).steps).toEqual([{ ...step, then: ["home"] }]);
  expect(firstGap({ steps: [step] })).toBeNull();
  for (const open of [{ ...step, then: [] }, { ...step, then: [{ pick: null }] }, { ...step, else: [{ wait: null }] }, { ...step, if: { answer: "" } }, newStep(JOB, "if")]) {
    expect(firstGap({ steps: [open] })).toEqual({ step: 0, inner: null });
  }
});

test("a renamed part keeps the speed of its step, and changes no question", () => {
  const job = { ...JOB, steps: [{ pick: "cube", speed: 0.5 }, { ask: "cube" }] };
  expect(renamed(job, "parts", "cube", "box").steps).toEqual([{ pick: "box", speed: 0.5 }, { ask: "cube" }]);
});

test.each([
  ["cube", { kind: "name", name: "cube" }],
  ["tray[next]", { kind: "cell", pallet: "tray", which: "next", row: "1", column: "1" }],
  ["tray[each]", { kind: "cell", pallet: "tray", which: "each", row: "1", column: "1" }],
  ["my tray [ 2 , 3 ]", { kind: "cell", pallet: "my tray", which: "number", row: "2", column: "3" }],
  ["tray[2,*]", { kind: "cell", pallet: "tray", which: "number", row: "2", column: "*" }],
  [[0.5, 1.1], { kind: "numbers", values: [0.5, 1.1] }],
  [{ x: 0.5, y: 1.1, z: 0.4 }, { kind: "numbers", values: [0.5, 1.1, 0.4] }],
  [{ x: 0.5, y: 1.1 }, { kind: "numbers", values: [0.5, 1.1] }],
  [{ a: 0.5, b: 1.7, c: 1.8 }, { kind: "numbers", values: [0.5, 1.7, 1.8] }],
  [[0.5, "x"], { kind: "numbers", values: [0.5, null] }],
  [null, { kind: "none" }],
  ["", { kind: "none" }],
])("reads the target %j", (argument, target) => {
  expect(readTarget(argument)).toEqual(target);
});

test.each(["cube", "tray[next]", "tray[each]", "tray[2,3]", [0.5, 1.1], [0.5, 1.1, 0.4]])("writes the target %j as it was read", (argument) => {
  expect(writeTarget(readTarget(argument))).toEqual(argument);
});

test("leaves out an empty height, and only that", () => {
  expect(trimmed([0.5, 1.1, null])).toEqual([0.5, 1.1]);
  expect(trimmed([null, 1.1, 0.4])).toEqual([null, 1.1, 0.4]);
});

test("finds the first thing that is not filled in", () => {
  expect(firstGap(JOB)).toBeNull();
  expect(firstGap({ steps: ["home", { pick: null }] })).toEqual({ step: 1, inner: null });
  expect(firstGap({ steps: [{ place: [0.5, null] }] })).toEqual({ step: 0, inner: null });
  expect(firstGap({ steps: [{ for_each: "box", do: [{ pick: "box[each]" }, { place: null }] }] })).toEqual({ step: 0, inner: 1 });
  expect(firstGap({ parts: { cube: [null, null] }, steps: ["home"] })).toEqual({ name: "cube" });
});

test.each([
  ["steps.2.pick", { step: 2, inner: null }],
  ["steps.2", { step: 2, inner: null }],
  ["steps.0.do.3.place", { step: 0, inner: 3 }],
  ["steps", null],
  ["places.tray", null],
])("finds the step of the key %s", (key, place) => {
  expect(stepOfKey(key)).toEqual(place);
});

test("keeps the usual order of keys, and no empty groups", () => {
  const job = tidy({ repeat: 1, steps: ["home"], places: {}, parts: { cube: [1, 1] }, name: "a" } as JobData);
  expect(Object.keys(job)).toEqual(["name", "parts", "steps"]);
  expect(Object.keys(tidy({ steps: ["home"], repeat: 2, name: undefined }))).toEqual(["steps", "repeat"]);
});

test("renames a place in every step, and keeps its position in the list", () => {
  const job = renamed(JOB, "places", "mat", "rug");
  expect(Object.keys(job.places ?? {})).toEqual(["tray", "rug"]);
  expect(job.steps[3]).toEqual({ for_each: "box", do: [{ approach: "box[each]" }, { line: "rug" }] });
  expect(renamed(JOB, "parts", "cube", "ball").steps[1]).toEqual({ pick: "ball" });
});

test("renames nothing to an empty or taken name", () => {
  expect(renamed(JOB, "places", "mat", "tray")).toBe(JOB);
  expect(renamed(JOB, "places", "mat", "cube")).toBe(JOB);
  expect(renamed(JOB, "places", "mat", "")).toBe(JOB);
});

test("adds and removes names", () => {
  expect(freshName(JOB, "cube")).toBe("cube 2");
  expect(freshName(JOB, "ball")).toBe("ball");
  expect(withName(JOB, "parts", "ball", [1, 1]).parts).toEqual({ cube: [0.5, 1.1], ball: [1, 1] });
  expect("parts" in withoutName(JOB, "parts", "cube")).toBe(false);
});

test("a new pick takes the first part that no step has picked", () => {
  const job: JobData = { parts: { red: [1, 1], blue: [1, 1] }, places: { tray: [1, 1] }, steps: [{ pick: "red" }] };
  expect(newStep(job, "pick")).toEqual({ pick: "blue" });
  expect(newStep(job, "place")).toEqual({ place: "tray" });
  expect(newStep({ steps: [] }, "pick")).toEqual({ pick: null });
  expect(newStep(job, "pick", "box")).toEqual({ pick: "box[each]" });
  expect(newStep(job, "home")).toBe("home");
});

test("finds the pallet of a loop", () => {
  expect(["tray", "tray[2,*]", null].map(palletOf)).toEqual(["tray", "tray", ""]);
});

test.each([
  [{ wish: { command: "home" } }, { name: "home", steps: ["home"] }],
  [{ wish: { command: "pick", target: [0.5, 1.1] } }, { name: "pick", steps: [{ pick: [0.5, 1.1] }] }],
  [{ wish: { command: "gripper", open: false } }, { name: "gripper", steps: [{ gripper: "close" }] }],
  [{ wish: { command: "move", joints: "shelf" } }, { name: "move", steps: [{ move: "shelf" }] }],
  [{ name: "a", steps: [{ home: true }, { for_each: "box", do: [{ pick: "box[each]" }] }] }, { name: "a", steps: ["home", { for_each: "box", do: [{ pick: "box[each]" }] }] }],
  [{ name: "a", steps: ["home"], taught: { shelf: 1 } }, { name: "a", steps: ["home"] }],
])("makes a job of the body %j", (body, job) => {
  expect(bodyAsJob(body)).toEqual(job);
});

test("leaves out a step, but none of a loop or of a repeated job", () => {
  expect(withoutStep(JOB, "steps.1")?.steps).toEqual([JOB.steps[0], JOB.steps[2], JOB.steps[3]]);
  expect(withoutStep(JOB, "steps.3.do.0")).toBeNull();
  expect(withoutStep(JOB, "steps.3")).toBeNull();
  expect(withoutStep({ ...JOB, repeat: 2 }, "steps.1")).toBeNull();
  expect(withoutStep({ steps: ["home"] }, "steps.0")).toBeNull();
});

test("of jobs with one name the newest is offered", () => {
  const lines = [{ id: 5, name: "sort" }, { id: 4, name: "" }, { id: 3, name: "fill" }, { id: 2, name: "sort" }];
  expect(newestByName(lines).map((one) => one.id)).toEqual([5, 3]);
});

test.each([
  ["home", null, { command: "home" }, "home"],
  ["pick", "cube", { command: "pick", target: "cube" }, { pick: "cube" }],
  ["move", [0, 1.8, 1.7], { command: "move", joints: [0, 1.8, 1.7] }, { move: [0, 1.8, 1.7] }],
  ["gripper", true, { command: "gripper", open: true }, { gripper: "open" }],
  ["gripper", false, { command: "gripper", open: false }, { gripper: "close" }],
] as const)("%s with %j is a task, a step, and the body of a job", (command, value, task, step) => {
  expect(taskOf(command, value)).toEqual(task);
  expect(stepOf(taskOf(command, value)!)).toEqual(step);
  expect(bodyAsJob({ wish: task }).steps).toEqual([step]);
});

test("a task is not complete until its argument is", () => {
  for (const command of ["pick", "move"] as const) expect(taskOf(command, null)).toBeNull();
});

test.each([["home", "home"], ["gripper", { gripper: "open" }], ["line", { line: null }]])("a new %s is %j", (command, step) => {
  expect(newStep(JOB, command)).toEqual(step);
});
