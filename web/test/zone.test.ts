import { describe, expect, it } from "vitest";
import { moved } from "../src/machine/plan.ts";
import { centredAt, draftOfZone, draggedTo, newZone, zoneOf } from "../src/pages/teach/zone.ts";

describe("a zone as it is entered", () => {
  it("is around the place, from the table up", () => {
    expect(zoneOf(newZone("box", [0.5, 1.1, 0.4]))).toEqual({ kind: "box", name: "", low: [0.4, 1, 0], high: [0.6, 1.2, 0.4], margin: 0.05, lines: true });
    expect(zoneOf(newZone("cylinder", [0.5, 1.1, 0]))).toMatchObject({ x: 0.5, y: 1.1, radius: 0.1, low: 0, high: 0.1 });
  });
  it("is no zone while a number is missing or it has no volume", () => {
    const box = newZone("box", [0.5, 1.1, 0.4]);
    expect(zoneOf({ ...box, margin: null })).toBeNull();
    expect(zoneOf({ ...box, low: [0.7, 1, 0] })).toBeNull();
    expect(zoneOf({ ...box, low: [0.4, null, 0] })).toBeNull();
    expect(zoneOf({ ...box, high: [0.6, 1.2, 0] })).toBeNull();
    expect(zoneOf({ ...newZone("cylinder", [0.5, 1.1, 0.4]), radius: 0 })).toBeNull();
  });
  it("survives a change and a drag", () => {
    const pole = { kind: "cylinder", name: "pole", x: 0.5, y: 0.6, radius: 0.1, low: 0, high: 1, margin: 0.02, lines: false } as const;
    const draft = draftOfZone(pole);
    expect([zoneOf(draft), draft.replace]).toEqual([pole, true]);
    expect(zoneOf(draggedTo(draft, moved(pole, 0.1, -0.1)))).toEqual({ ...pole, x: 0.6, y: 0.5 });
    const box = zoneOf(newZone("box", [0.5, 1.1, 0.4]));
    expect(zoneOf(draggedTo(draftOfZone(box as never), moved(box as never, 0.1, 0)))).toMatchObject({ low: [0.5, 1, 0], high: [0.7, 1.2, 0.4] });
  });
  it("keeps its size when its middle is dragged in space", () => {
    const draft = newZone("box", [0.5, 1.1, 0.4]);
    const zone = zoneOf(draft)!;
    expect(zoneOf(centredAt(draft, zone, [0.6, 1.1, 0.3]))).toEqual({ ...zone, low: [0.5, 1, 0.1], high: [0.7, 1.2, 0.5] });
    const pole = newZone("cylinder", [0.5, 1.1, 0.4]);
    expect(zoneOf(centredAt(pole, zoneOf(pole)!, [0.5, 1, 0.7]))).toMatchObject({ x: 0.5, y: 1, low: 0.5, high: 0.9 });
  });
});
