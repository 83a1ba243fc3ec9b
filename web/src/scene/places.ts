import * as THREE from "three";
import type { Zone } from "../machine/plan.ts";
import type { PalletInfo, Point, TaughtPose } from "../generated/api.ts";
import { token } from "../look/theme.ts";
import { cellOf, MOST_NAMES } from "../state/places.ts";
import { empty, glass, lambert, named } from "./materials.ts";
import { bodyOf } from "./zones.ts";

/** Cells of a pallet beyond this number are not drawn one by one. */
const MOST_CELLS = 400;

/** Taught poses, pallets, and a zone that is being entered, in the 3D picture. */
export class PlacesLayer {
  readonly group = new THREE.Group();
  private readonly poses = new THREE.Group();
  private readonly pallets = new THREE.Group();
  private readonly draft = new THREE.Group();

  constructor(private readonly changed: () => void) {
    this.group.add(this.poses, this.pallets, this.draft);
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
      text.position.set(point[0], point[1], point[2] + 0.07);
      this.poses.add(text);
    }
    this.changed();
  }

  setPallets(pallets: readonly PalletInfo[]): void {
    empty(this.pallets);
    for (const pallet of pallets) {
      if (pallet.corners === null || pallet.corners.length < 4) continue;
      const around = [0, 1, 3, 2].map((i) => new THREE.Vector3(...(pallet.corners?.[i] as Point)));
      const edge = named(new THREE.LineLoop(new THREE.BufferGeometry().setFromPoints(around), new THREE.LineBasicMaterial({ color: token("c3") })), "c3");
      const text = label(pallet.name);
      text.position.copy(around[0]!).add(new THREE.Vector3(0, 0, 0.05));
      this.pallets.add(edge, text);
      if (pallet.rows * pallet.columns > MOST_CELLS) continue;
      for (let row = 1; row <= pallet.rows; row++) {
        for (let column = 1; column <= pallet.columns; column++) {
          const dot = named(new THREE.Mesh(new THREE.SphereGeometry(0.008, 8, 6), lambert("c3")), "c3");
          dot.position.set(...(cellOf(pallet, row, column) as Point));
          this.pallets.add(dot);
        }
      }
    }
    this.changed();
  }

  setDraft(zone: Zone | null): void {
    empty(this.draft);
    if (zone !== null) {
      const body = named(bodyOf(zone, glass(token("accent"), 0.35)), "accent");
      const edges = named(new THREE.LineSegments(new THREE.EdgesGeometry(body.geometry, 30), new THREE.LineBasicMaterial({ color: token("accent") })), "accent");
      edges.position.copy(body.position);
      edges.quaternion.copy(body.quaternion);
      this.draft.add(body, edges);
    }
    this.changed();
  }
}

/** Returns a text that faces the camera, with an outline that both themes can read. */
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
  const sprite = new THREE.Sprite(new THREE.SpriteMaterial({ map, depthTest: false }));
  const height = 0.1;
  sprite.scale.set((height * canvas.width) / Math.max(1, canvas.height), height, 1);
  return sprite;
}
