import { computed, reactive } from "vue";
import type { Point, Task } from "../../generated/api.ts";
import { DECLARED, type PrimitiveName } from "../../generated/primitives.ts";
import { taskOf } from "../../parts/job.ts";
import { cellOf, pallets, poses } from "../../state/places.ts";
import { table } from "../../state/robot.ts";

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

/** Whether a primitive goes to joints, not to coordinates. */
export const toJoints = (primitive: PrimitiveName) => DECLARED[primitive].kind === "joints";

/** Whether a primitive has a target. */
export const hasTarget = (primitive: PrimitiveName) => DECLARED[primitive].kind === "target" || toJoints(primitive);

/** Returns how the target is given. */
export function wayOf(primitive: PrimitiveName, by: typeof draft.by): typeof draft.by {
  if (toJoints(primitive)) return by === "name" ? "name" : "joints";
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
  const { kind } = DECLARED[draft.primitive];
  return taskOf(draft.primitive, kind === "switch" ? draft.open : kind === "joints" ? joints.value : target.value);
});
