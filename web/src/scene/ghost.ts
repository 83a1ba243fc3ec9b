import * as THREE from "three";
import type { Geometry, Point } from "../generated/api.ts";
import { token } from "../look/theme.ts";
import { jointsFor } from "../machine/kinematics.ts";
import { Figure } from "./figure.ts";
import { dashed, fill } from "./line.ts";
import { glass, named } from "./materials.ts";

/** A motion that has not begun: gripper points along its path [m], and its target if that is a point. */
export interface Ahead {
  points: readonly Point[];
  target: readonly number[] | boolean | null;
}

/** A path that comes as near to its target passes through it [m]; the ends of its motions are among its points. */
const NEAR = 0.005;

const INK = "accent";
const OPACITY = 0.32;
const MOST_POINTS = 256;

/** Returns where a motion goes: its target if the path passes through it, as a pick does, else the end of the path. */
export function goalOf({ points, target }: Ahead): Point | null {
  if (Array.isArray(target)) {
    const [x, y, z] = target as Point;
    if (points.some((one) => Math.hypot(one[0] - x, one[1] - y, one[2] - z) <= NEAR)) return [x, y, z];
  }
  return points.at(-1) ?? null;
}

/** The next motion: a translucent figure of the robot where it goes, and the path to it. */
export class Ghost {
  readonly group = new THREE.Group();
  private readonly figure: Figure;
  private readonly path = named(dashed(MOST_POINTS, 0.03, 0.03), INK);

  constructor(private readonly geometry: Geometry) {
    this.figure = new Figure(geometry, () => glass(token(INK), OPACITY));
    this.figure.group.traverse((one) => one instanceof THREE.Mesh && named(one, INK));
    this.group.add(this.figure.group, this.path);
    this.group.visible = false;
  }

  /** Shows a motion; null, or one without a path, shows nothing. Returns where the figure stands [m]. */
  show(ahead: Ahead | null): Point | null {
    const goal = ahead && goalOf(ahead);
    this.group.visible = goal !== null;
    if (goal === null) return null;
    fill(this.path, ahead?.points ?? []);
    this.path.computeLineDistances();
    return this.figure.pose(...jointsFor(this.geometry, goal));
  }
}
