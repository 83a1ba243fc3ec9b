import { shallowRef, watch, type ShallowRef } from "vue";
import { ask } from "../api/ask.ts";
import type { WorkspaceShape } from "../generated/api.ts";
import { connection, state } from "../state/robot.ts";

/**
 * The shape of the workspace with its rings at a height [m], null until it is known. It is read again when the height
 * changes or the robot is homed, with one request at a time.
 */
export function useShape(height: () => number): ShallowRef<WorkspaceShape | null> {
  const shape = shallowRef<WorkspaceShape | null>(null);
  let reading = false;
  let again = false;

  async function read(): Promise<void> {
    again = reading;
    if (reading || connection.value !== "live") return;
    reading = true;
    shape.value = (await ask("GET /v1/workspace", { query: { z: height() } }).catch(() => null)) ?? shape.value;
    reading = false;
    if (again) void read();
  }

  watch([height, connection, () => state.value?.homed], () => void read(), { immediate: true });
  return shape;
}
