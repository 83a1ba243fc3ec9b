import * as THREE from "three";
import type { Zone } from "../machine/plan.ts";
import type { PalletInfo, Point, TaughtPose } from "../generated/api.ts";
import { token } from "../look/theme.ts";
import { cellOf, MOST_NAMES } from "../state/places.ts";
import { empty, glass, lambert, named } from "./materials.ts";
import { bodyOf } from "./zones.ts";

/** Cells of a pallet beyond this number are not drawn one by one. */
const MOST_CELLS = 400;

/** Height of a text on the screen, whatever the distance [px]. */
const TEXT = 20;

/** A grid of places with its four corners [m]. */
export type PalletGrid = Pick<PalletInfo, "rows" | "columns" | "corners"> & { corners: Point[] };

/** The zone or pallet that is being entered or moved. A pose is its handle alone. */
export interface Draft {
  zone?: Zone | null;
  grid?: PalletGrid | null;
}

/** Taught poses, pallets, and what is being entered, in the 3D picture. */
export class PlacesLayer {
  readonly group = new THREE.Group();
  private readonly poses = new THREE.Group();
  private readonly pallets = new THREE.Group();
  private readonly draft = new THREE.Group();

  private pixel = 0.001;

  constructor(private readonly changed: () => void) {
    this.group.add(this.poses, this.pallets, this.draft);
  }

  /** Takes the length of a pixel at the distance 1. */
  setPixel(pixel: number): void {
    this.pixel = pixel;
    this.size();
  }

  setPoses(poses: readonly TaughtPose[]): void {
    empty(this.poses);
    for (const { name, point } of poses) {
      if (point === null) continue;
      const ball = named(new THREE.Mesh(new THREE.OctahedronGeometry(0.025), lambert("c3")), "c3");
      ball.position.set(...point);
      this.poses.add(ball);
      if (poses.length > MOST_NAMES) continue;
      const text = label(name);
      text.position.set(point[0], point[1], point[2] + 0.03);
      this.poses.add(text);
    }
    this.size();
    this.changed();
  }

  setPallets(pallets: readonly PalletInfo[]): void {
    empty(this.pallets);
    for (const { name, rows, columns, corners } of pallets) {
      if (corners === null || corners.length < 4) continue;
      const [x, y, z] = corners[0] as Point;
      const text = label(name);
      text.position.set(x, y, z + 0.02);
      this.pallets.add(text, ...gridOf({ rows, columns, corners }, "c3"));
    }
    this.size();
    this.changed();
  }

  /** Draws what is being entered or moved. */
  setDraft(draft: Draft | null): void {
    empty(this.draft);
    if (draft?.zone) {
      const body = named(bodyOf(draft.zone, glass(token("accent"), 0.35)), "accent");
      const edges = named(new THREE.LineSegments(new THREE.EdgesGeometry(body.geometry, 30), new THREE.LineBasicMaterial({ color: token("accent") })), "accent");
      edges.position.copy(body.position);
      edges.quaternion.copy(body.quaternion);
      this.draft.add(body, edges);
    }
    if (draft?.grid) this.draft.add(...gridOf(draft.grid, "accent"));
    this.changed();
  }

  private size(): void {
    this.group.traverse((one) => {
      if (one instanceof THREE.Sprite) one.scale.set(TEXT * this.pixel * (one.userData["aspect"] as number), TEXT * this.pixel, 1);
    });
  }
}

/** Returns the outline of a grid and, if they are not too many, its cells. */
function gridOf(grid: PalletGrid, colour: string): THREE.Object3D[] {
  const { rows, columns, corners } = grid;
  const around = [0, 1, 3, 2].map((i) => new THREE.Vector3(...(corners[i] as Point)));
  const edge = named(new THREE.LineLoop(new THREE.BufferGeometry().setFromPoints(around), new THREE.LineBasicMaterial({ color: token(colour) })), colour);
  if (rows * columns > MOST_CELLS) return [edge];
  const ball = new THREE.SphereGeometry(0.008, 8, 6);
  const dots = Array.from({ length: rows * columns }, (_, i) => {
    const dot = named(new THREE.Mesh(ball, lambert(colour)), colour);
    dot.position.set(...(cellOf(grid, Math.floor(i / columns) + 1, (i % columns) + 1) as Point));
    return dot;
  });
  return [edge, ...dots];
}

/** Returns a text that faces the camera and stands on its place, with an outline that both themes can read. */
function label(text: string): THREE.Sprite {
  const canvas = document.createElement("canvas");
  const pen = canvas.getContext("2d");
  const size = 36;
  const font = `600 ${size}px Inter, sans-serif`;
  if (pen !== null) {
    pen.font = font;
    canvas.width = Math.ceil(pen.measureText(text).width) + 16;
    canvas.height = size * 1.5;
    pen.font = font;
    pen.textBaseline = "middle";
    pen.lineWidth = 8;
    pen.lineJoin = "round";
    pen.strokeStyle = token("surface");
    pen.fillStyle = token("ink");
    pen.strokeText(text, 8, canvas.height / 2);
    pen.fillText(text, 8, canvas.height / 2);
  }
  const map = new THREE.CanvasTexture(canvas);
  map.colorSpace = THREE.SRGBColorSpace; // otherwise dark letters come out grey
  const sprite = new THREE.Sprite(new THREE.SpriteMaterial({ map, depthTest: false, sizeAttenuation: false }));
  sprite.center.set(0.5, 0);
  sprite.userData["aspect"] = canvas.width / Math.max(1, canvas.height);
  return sprite;
}
