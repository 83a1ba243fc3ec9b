import { describe, expect, it, vi } from "vitest";
import type { FleetRobot, FleetStep, FleetView } from "../src/generated/api.ts";

vi.stubGlobal("localStorage", { getItem: () => null });
const { ago, counted, described, isQuiet, QUIET } = await import("../src/pages/robots/fleet.ts");
const { language } = await import("../src/words/index.ts");

const SINCE = "2027-01-31T12:00:00.000+00:00";
const NOW = Date.parse(SINCE);

function step(changes: Partial<FleetStep>): FleetStep {
  return { id: "5b0cdf0e-1111", state: "executing", since: SINCE, command: null, args: {}, supervisor: null, duration: null, error: null, code: null, ...changes };
}

function robot(changes: Partial<FleetRobot>): FleetRobot {
  return { name: "MAYA", state: "idle", since: null, heard: null, step: null, waiting: 0, last: [], ...changes };
}

function fleet(robots: FleetRobot[], changes: Partial<FleetView> = {}): FleetView {
  return { link: "connected", broker: "mqtt://lab", since: SINCE, trouble: null, refused: false, robots, more: 0, ...changes };
}

describe("described", () => {
  it.each([
    ["pick", { x: 0.5, y: 1.1, z: 0.4 }, "Pick 500.0, 1100.0, 400.0 mm"],
    ["move", { a: Math.PI / 2, b: 1.5, c: 1.6 }, "Move joints 90.00 °, 1500.0, 1600.0 mm"],
    ["gripper", { open: true }, "Gripper open"],
    ["gripper", { open: false }, "Gripper close"],
    ["home", {}, "Home"],
    ["can_teleop", {}, "Ask whether it is ready"],
    ["pick", { x: null, y: "far", z: 0.4 }, "Pick –, –, 400.0 mm"],
    ["<b>dance</b>", {}, "<b>dance</b>"],
  ])("names %s with %o", (command, args, text) => {
    language.value = "en";
    expect(described(step({ command, args }))).toBe(text);
  });

  it("shows the id of a step whose command was not seen", () => {
    expect(described(step({}))).toBe("Step 5b0cdf0e");
  });

  it("speaks Spanish", () => {
    language.value = "es";
    expect(described(step({ command: "gripper", args: { open: false } }))).toBe("Pinza cerrar");
    language.value = "en";
  });
});

describe("ago", () => {
  it.each([
    [0, "0 s ago"],
    [-5_000, "0 s ago"],
    [59_999, "59 s ago"],
    [60_000, "1 min ago"],
    [3_599_000, "59 min ago"],
  ])("says %i ms as %s", (passed, text) => {
    expect(ago(SINCE, NOW + passed)).toBe(text);
  });

  it("is a date after an hour", () => {
    expect(ago(SINCE, NOW + 3_600_000)).toMatch(/^on 31 Jan 2027/);
  });
});

describe("isQuiet", () => {
  it("is so if connected robots show no step for a while", () => {
    expect(isQuiet(fleet([robot({})]), NOW + QUIET - 1)).toBe(false);
    expect(isQuiet(fleet([robot({})]), NOW + QUIET)).toBe(true);
  });

  it.each([
    ["a step is under way", fleet([robot({}), robot({ step: step({}) })])],
    ["a step waits", fleet([robot({ waiting: 1 })])],
    ["a step has ended", fleet([robot({ last: [step({ state: "done" })] })])],
    ["no robot is connected", fleet([robot({ state: "offline" }), robot({ state: "lost" })])],
    ["the broker has refused it in words", fleet([robot({})], { refused: true })],
    ["the broker is lost", fleet([robot({})], { link: "lost" })],
  ])("is not so if %s", (_why, view) => {
    expect(isQuiet(view, NOW + 10 * QUIET)).toBe(false);
  });
});

describe("counted", () => {
  it("counts the robots of each state that there is", () => {
    expect(counted([robot({ state: "lost" }), robot({}), robot({ state: "working" }), robot({})])).toEqual([["idle", 2], ["working", 1], ["lost", 1]]);
  });
});
