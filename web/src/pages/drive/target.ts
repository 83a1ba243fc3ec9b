import { computed, reactive } from "vue";
import type { Point, Task } from "../../generated/api.ts";
import { cellOf, pallets, poses } from "../../state/places.ts";
import { table } from "../../state/robot.ts";
import type { PRIMITIVES } from "../../words/common.ts";

export type PrimitiveName = keyof typeof PRIMITIVES;

/** A single primitive with its target, as the page Drive holds it. It stays while the page is left. */
export const draft = reactive({
  primitive: "line" as PrimitiveName,
  by: "coordinates" as "coordinates" | "name" | "joints",
  x: null as number | null,
  y: null as number | null,
  z: null as number | null,
  joints: { a: null as number | null, b: null as number | null, c: null as number | null },
  /** "pose/NAME", "part/NAME" or "cell/PALLET". */
  name: "",
  row: 1 as number | null,
  column: 1 as number | null,
  open: true,
});

/** Whether a primitive has a target, and whether coordinates can be one. */
export const hasTarget = (primitive: PrimitiveName) => primitive !== "home" && primitive !== "gripper";

/** Returns how the target is given: joints are for `move` alone, which takes no coordinates. */
export function wayOf(primitive: PrimitiveName, by: typeof draft.by): typeof draft.by {
  if (primitive === "move") return by === "name" ? "name" : "joints";
  return by === "joints" ? "coordinates" : by;
}

export const way = computed(() => wayOf(draft.primitive, draft.by));

function split(name: string): [kind: string, name: string] {
  const cut = name.indexOf("/");
  return [name.slice(0, cut), name.slice(cut + 1)];
}

/** The place of the target [m]; null if it is unknown or not complete. */
export const targetPoint = computed<Point | null>(() => {
  if (!hasTarget(draft.primitive)) return null;
  if (way.value === "coordinates") {
    const { x, y, z } = draft;
    return x === null || y === null || z === null ? null : [x, y, z];
  }
  if (way.value === "joints") return null;
  const [kind, name] = split(draft.name);
  if (kind === "pose") return poses.value.find((one) => one.name === name)?.point ?? null;
  if (kind === "part") return (table.value[name] as Point | null | undefined) ?? null;
  const pallet = pallets.value.find((one) => one.name === name);
  return pallet === undefined ? null : cellOf(pallet, draft.row ?? 1, draft.column ?? 1);
});

/** The target as messages have it: coordinates, or the name of a pose or cell. A part has no name beyond its job. */
const target = computed<number[] | string | null>(() => {
  if (way.value === "coordinates") return targetPoint.value;
  const [kind, name] = split(draft.name);
  if (kind === "pose") return name;
  if (kind === "cell") return `${name}[${draft.row ?? 1},${draft.column ?? 1}]`;
  return targetPoint.value;
});

const joints = computed<number[] | string | null>(() => {
  if (way.value === "name") return typeof target.value === "string" ? target.value : null;
  const { a, b, c } = draft.joints;
  return a === null || b === null || c === null ? null : [a, b, c];
});

/** The task to do, null while its target is not complete. */
export const task = computed<Task | null>(() => {
  const { primitive } = draft;
  if (primitive === "home") return { command: "home" };
  if (primitive === "gripper") return { command: "gripper", open: draft.open };
  if (primitive === "move") return joints.value === null ? null : { command: "move", joints: joints.value };
  return target.value === null ? null : { command: primitive, target: target.value };
});
