import * as THREE from "three";
import { describe, expect, it } from "vitest";
import type { Point } from "../src/generated/api.ts";
import { Grips, type Pixel, type Way } from "../src/scene/grips.ts";

const VIEWS: Record<string, Point> = { perspective: [3, 3.2, 2.6], top: [0.6, 0.599, 5], side: [5, 0.599, 0.7] };
const AT: Point = [0.6, 0.9, 0.4];

function grips(from: Point): Grips {
  const camera = new THREE.PerspectiveCamera(38, 800 / 500, 0.05, 30);
  camera.up.set(0, 0, 1);
  camera.position.set(...from);
  camera.lookAt(0.6, 0.6, 0.6);
  camera.updateMatrixWorld();
  return new Grips(camera, { clientWidth: 800, clientHeight: 500 } as HTMLCanvasElement);
}

/** Drags the grip from its place on the screen to where another place is seen. */
function dragged(view: Grips, to: Point, way: Way): Point | null {
  return view.grab(AT, way, view.seen(AT) as Pixel)(view.seen(to) as Pixel);
}

describe("a grip", () => {
  it("follows the pointer on its level", () => {
    for (const from of [VIEWS["perspective"]!, VIEWS["top"]!]) {
      expect(dragged(grips(from), [0.75, 1.02, 0.4], null)).toEqual([0.75, 1.02, 0.4]);
    }
  });
  it("follows the pointer in the plane of a view that looks along the level", () => {
    expect(dragged(grips(VIEWS["side"]!), [0.6, 1.0, 0.7], null)).toEqual([0.6, 1, 0.7]);
  });
  it.each<[Way, Point]>([[0, [0.85, 0.9, 0.4]], [1, [0.6, 1.1, 0.4]], [2, [0.6, 0.9, 0.9]]])("changes axis %i alone", (way, to) => {
    expect(dragged(grips(VIEWS["perspective"]!), to, way)).toEqual(to);
    const beside = dragged(grips(VIEWS["perspective"]!), [to[0] + 0.02, to[1] - 0.05, to[2] + 0.03], way)!;
    beside.forEach((value, i) => i !== way && expect(value).toBe(AT[i]));
  });
  it("does not jump when it is pressed beside its middle", () => {
    const view = grips(VIEWS["perspective"]!);
    const [x, y] = view.seen(AT) as Pixel;
    expect(view.grab(AT, null, [x + 9, y - 7])([x + 9, y - 7])).toEqual(AT);
  });
  it("stays where it is beyond the horizon, and is not seen behind the camera", () => {
    const view = grips(VIEWS["perspective"]!);
    expect(view.grab(AT, null, view.seen(AT) as Pixel)([400, -4000])).toBeNull();
    expect(view.seen([6, 6.4, 5])).toBeNull();
  });
  it("has arrows of one length on the screen, whatever the distance", () => {
    const long = (from: Point) => {
      const view = grips(from);
      const at = view.seen(AT) as Pixel;
      return Math.max(...view.tips(AT).map((tip) => Math.hypot(tip[0] - at[0], tip[1] - at[1])));
    };
    expect(long([1.5, 1.6, 1.3]) / long([6, 6.4, 5.2])).toBeCloseTo(1, 0);
  });
});
