import * as THREE from "three";
import type { Point } from "../generated/api.ts";
import { exact, fine } from "../machine/plan.ts";

/** A place in the 3D view that a person may drag. */
export interface Grip {
  id: string;
  /** The name of the thing that it moves, for screen readers. */
  label: string;
  point: Point;
}

export type Pixel = [x: number, y: number];

/** The number of an axis; null for the level. */
export type Way = 0 | 1 | 2 | null;

/** Length of the arrows along the axes on the screen, whatever the distance [px]. */
const ARROW = 76;

/** A view that looks at the level under a smaller angle would move a grip far by a small drag; the sine of that angle. */
const FLAT = 0.25;

const AXES = [new THREE.Vector3(1, 0, 0), new THREE.Vector3(0, 1, 0), new THREE.Vector3(0, 0, 1)] as const;

/** Turns places of the 3D view into pixels of its canvas, and the way of a pointer into a way in space. */
export class Grips {
  constructor(
    private readonly camera: THREE.PerspectiveCamera,
    private readonly canvas: HTMLCanvasElement,
  ) {}

  /** Returns where a point [m] is on the canvas; null behind the camera. */
  seen(point: Point): Pixel | null {
    const place = new THREE.Vector3(...point);
    return place.clone().project(this.camera).z > 1 ? null : this.pixel(place);
  }

  /** Returns where arrows from a point along the axes end on the canvas. */
  tips(point: Point): Pixel[] {
    const from = new THREE.Vector3(...point);
    const high = 2 * Math.tan(((this.camera.fov / 2) * Math.PI) / 180);
    const pixel = (this.camera.position.distanceTo(from) * high) / Math.max(1, this.canvas.clientHeight);
    return AXES.map((axis) => this.pixel(from.clone().addScaledVector(axis, ARROW * pixel)));
  }

  /** Returns a function of the pointer's place that returns the place of a grip, whole mm from its old one. */
  grab(point: Point, way: Way, pointer: Pixel): (pointer: Pixel) => Point | null {
    const from = new THREE.Vector3(...point);
    const plane = new THREE.Plane().setFromNormalAndCoplanarPoint(this.normal(from, way), from);
    const start = this.under(pointer, plane);
    return (now) => {
      const under = this.under(now, plane);
      if (start === null || under === null) return null;
      const moved = under.sub(start);
      if (way !== null) moved.projectOnVector(AXES[way]);
      return [exact(from.x + fine(moved.x)), exact(from.y + fine(moved.y)), exact(from.z + fine(moved.z))];
    };
  }

  private pixel(place: THREE.Vector3): Pixel {
    const { x, y } = place.clone().project(this.camera);
    return [((x + 1) / 2) * this.canvas.clientWidth, ((1 - y) / 2) * this.canvas.clientHeight];
  }

  /** The plane of a drag: along an axis the one that faces the camera, else the level, unless the camera looks along it. */
  private normal(at: THREE.Vector3, way: Way): THREE.Vector3 {
    const look = at.clone().sub(this.camera.position).normalize();
    if (way !== null) return look.projectOnPlane(AXES[way]).normalize();
    if (Math.abs(look.z) >= FLAT) return AXES[2];
    return Math.abs(look.x) > Math.abs(look.y) ? AXES[0] : AXES[1];
  }

  /** Returns the place under the pointer in a plane; null beyond its horizon. */
  private under(pointer: Pixel, plane: THREE.Plane): THREE.Vector3 | null {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const far = new THREE.Vector3((pointer[0] / width) * 2 - 1, 1 - (pointer[1] / height) * 2, 0.5).unproject(this.camera);
    const ray = new THREE.Ray(this.camera.position, far.sub(this.camera.position).normalize());
    return ray.intersectPlane(plane, new THREE.Vector3());
  }
}
